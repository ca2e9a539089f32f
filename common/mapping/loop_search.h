// Searches for the body's position among objects of earlier visits and other sessions. Finds which
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
  double deviation_m = 0.0;   ///< in the plane, from the first anchor of its component
  bool others_only = false;   ///< search only among objects of other sessions

  const Anchor& here() const { return *way.last(); }
  /// T_body,anchor; nothing if no path leads to the anchor.
  std::optional<LevelGaussian> to(AnchorId anchor) const;
  /// Whether the search includes objects that were detected from the anchor.
  bool asks(AnchorId anchor) const;
  /// Whether the object is of another session, or was not detected within the last `visit_m`
  /// travelled.
  bool isOld(const ObjectRecord& record, double visit_m) const;
  /// Anchors of the session within this distance travelled, in order.
  std::vector<AnchorId> anchorsOfVisit(double visit_m) const;
  /// Objects that were detected within this distance travelled, by id.
  std::vector<ObjectId> objectsOfVisit(double visit_m) const;
};

/// The last sighting of an object before this visit; nothing if the object is new.
const Sighting* sightingOfBefore(const ObjectRecord& record, const Whereabouts& body,
                                 double visit_m);
/// Whether both anchors are of one session, less than visit_m of travel apart. No object measured
/// the relative pose of anchors of different visits.
bool isOneVisit(const MapState& state, AnchorId a, AnchorId b, double visit_m);
/// Transforms the object to M.
PlacedObject inM(const MapState& state, const Sighting& sighting);

/// The last position before the odometry lost its frame of reference. It is a prior for locating
/// the next session.
struct LastPlace {
  AnchorId anchor = 0;  ///< newest anchor of the session that ended
  AnchorId begins = 0;  ///< F, the first anchor of the next session
  LevelGaussian T_MF;   ///< in the M of the component of `anchor`; the yaw is unknown
};

/// T_Mb relative to an anchor, without the anchor's own error in M.
LevelGaussian bodyByGraph(const Whereabouts& body, const LevelGaussian& T_ba);

/// Anchors of earlier visits within the body's uncertainty, nearest first, with their distance in
/// the plane. The uncertainty is that from the first anchor of the component, because nearer
/// anchors are better known.
std::vector<std::pair<double, AnchorId>> anchorsOfBefore(const Whereabouts& body,
                                                         const Parameters& parameters);

class LoopSearch {
 public:
  explicit LoopSearch(const Parameters& parameters) : parameters_(parameters) {}

  struct Found {
    PlaceMatch match;                    ///< T_MB in the M of the component of the match
    AnchorId home = 0;                   ///< the anchor of most of the known objects
    std::optional<LevelGaussian> prior;  ///< by odometry and graph; nothing: no prior position
    double sigma_m = 0.0;                ///< deviation of the prior in the plane
  };

  /// Searches the part of the map that is connected with the body. Returns a match that is
  /// accepted.
  std::optional<Found> nearby(const Whereabouts& body) const;
  /// Searches the components of the graph that are not connected with the body's session.
  std::optional<Found> elsewhere(const Whereabouts& body);
  /// Searches the component of the session that ended, around its last position. Returns a match
  /// that needs no second search.
  std::optional<Found> nearLast(const Whereabouts& body, const LastPlace& last) const;
  /// Call it if the graph or the objects of other components have changed.
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
