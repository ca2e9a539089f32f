// Estimates the pose of the body from objects of earlier visits and other sessions, and finds which
// of them the body detects now.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "common/mapping/frames/anchor_builder.h"
#include "common/mapping/graph/marginals.h"
#include "common/mapping/map_state.h"
#include "common/mapping/parameters.h"
#include "common/mapping/places/constellation.h"

namespace perdure::mapping {

/// The position of the body, and the objects to search among.
struct Whereabouts {
  const MapState& state;
  const AnchorBuilder& way;
  const Marginals& relative;  ///< transforms relative to the body's newest anchor
  double widening = 1.0;      ///< factor on the standard deviations of these transforms
  double deviation_m = 0.0;   ///< σ of the body in the plane, from its component's first anchor
  bool others_only = false;   ///< search only among objects of other sessions

  const Anchor& here() const { return *way.last(); }
  /// The pose of the anchor relative to the body's newest anchor, with widened covariance; nothing
  /// if no path leads to the anchor.
  std::optional<LevelGaussian> to(AnchorId anchor) const;
  /// Whether the search includes objects that were detected from the anchor.
  bool asks(AnchorId anchor) const;
  /// Whether the last detection was in another session, or more than `visit_m` of travel ago.
  bool isOld(const ObjectRecord& record, double visit_m) const;
  /// Anchors of the session within `visit_m` of travel from the body, in order.
  std::vector<AnchorId> anchorsOfVisit(double visit_m) const;
  /// Objects that were last detected within `visit_m` of travel from the body, by id.
  std::vector<ObjectId> objectsOfVisit(double visit_m) const;
};

/// Returns the last sighting of an object before this visit; null if the object is new.
const Sighting* sightingOfBefore(const ObjectRecord& record, const Whereabouts& body,
                                 double visit_m);
/// Whether both anchors are of one session, less than `visit_m` of travel apart. Objects do not
/// measure the relative pose of anchors of different visits.
bool isOneVisit(const MapState& state, AnchorId a, AnchorId b, double visit_m);
/// Transforms the object of a sighting to M.
PlacedObject inM(const MapState& state, const Sighting& sighting);

/// The last position before the odometry lost its frame of reference. It is the prior for locating
/// the next session.
struct LastPlace {
  AnchorId anchor = 0;  ///< newest anchor of the session that ended
  AnchorId begins = 0;  ///< F, the first anchor of the next session
  LevelGaussian T_MF;   ///< M: of the component of `anchor`; the yaw is unknown
};

/// Returns T_Mb with its error relative to the anchor a, without that anchor's own error in M.
LevelGaussian bodyByGraph(const Whereabouts& body, const LevelGaussian& T_ba);

/// Returns anchors of earlier visits within reach of the body, nearest first, with their distance
/// in the plane, m. The reach includes the body's uncertainty from the first anchor of its
/// component, which bounds that from nearer anchors.
std::vector<std::pair<double, AnchorId>> anchorsOfBefore(const Whereabouts& body,
                                                         const Parameters& parameters);

class LoopSearch {
 public:
  explicit LoopSearch(const Parameters& parameters) : parameters_(parameters) {}

  struct Found {
    PlaceMatch match;                    ///< match.T_MB is in the M of the matched component
    AnchorId home = 0;                   ///< anchor of known objects, at which the loop closure
                                         ///< ends
    std::optional<LevelGaussian> prior;  ///< T_MB by odometry and graph; nothing: no prior position
    double sigma_m = 0.0;                ///< standard deviation of the prior in the plane
  };

  /// Searches the part of the map that is connected with the body. Returns a match only if its
  /// evidence suffices.
  std::optional<Found> nearby(const Whereabouts& body) const;
  /// Searches the components of the graph that are not connected with the body. The match needs a
  /// second one that agrees.
  std::optional<Found> elsewhere(const Whereabouts& body);
  /// Searches the component of the session that ended, around its last position. Returns a match
  /// that needs no second search.
  std::optional<Found> nearLast(const Whereabouts& body, const LastPlace& last) const;
  /// Clears the index of the other components. Call it if the graph or their objects have changed.
  void forget() { others_.clear(); }

 private:
  std::vector<PlacedObject> seenOfLate(const Whereabouts& body) const;
  struct Around {
    std::vector<PlacedObject> objects;
    std::map<ObjectId, AnchorId> homes;
    std::vector<Eigen::Vector2d> driven;
    std::optional<LevelGaussian> nearest;  ///< T_ba of the nearest anchor
  };
  Around mapAround(const Whereabouts& body) const;
  std::set<ObjectId> objectsSeenFrom(AnchorId anchor, const Whereabouts& body) const;
  bool isBelieved(const PlaceMatch& match, double sigma_m) const;
  bool isSureAtOnce(const PlaceMatch& match) const;
  void indexOthers(const Whereabouts& body);

  Parameters parameters_;
  struct Other {
    std::unique_ptr<MapIndex> index;
    std::map<ObjectId, AnchorId> homes;
  };
  std::map<AnchorId, Other> others_;  ///< components, by their first anchors
};

}  // namespace perdure::mapping
