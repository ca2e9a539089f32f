// Looks for the body among the objects of earlier visits and of other sessions, and says which are
// what it sees.
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

/// Where the body is, and what has been asked of it.
struct Whereabouts {
  const MapState& state;
  const AnchorBuilder& way;
  const Marginals& relative;  ///< to the body's newest anchor
  double deviation_m = 0.0;   ///< in the plane, from the first anchor of its component
  bool others_only = false;   ///< asked is what other sessions have seen

  const Anchor& here() const { return *way.last(); }
  /// Whether what was seen from the anchor is asked.
  bool asks(AnchorId anchor) const;
  /// Of another session, or not detected within `visit_m` of way.
  bool isOld(const ObjectRecord& record, double visit_m) const;
  /// Anchors of the session within so much way, in order.
  std::vector<AnchorId> anchorsOfVisit(double visit_m) const;
  /// Objects that were detected within so much way, by id.
  std::vector<ObjectId> objectsOfVisit(double visit_m) const;
};

/// What is known of an object from before this visit; nothing if it is new.
const Sighting* sightingOfBefore(const ObjectRecord& record, const Whereabouts& body,
                                 double visit_m);
/// Whether a body set both anchors on one way of less than visit_m. How the anchors of two visits
/// lie to each other is not measured by objects of both.
bool isOneVisit(const MapState& state, AnchorId a, AnchorId b, double visit_m);
/// The object in M.
PlacedObject inM(const MapState& state, const Sighting& sighting);

/// Where the body was when the odometry lost its frame of reference, for the search of a session
/// that begins after that.
struct LastPlace {
  AnchorId anchor = 0;  ///< the newest one of the session that ended
  AnchorId begins = 0;  ///< F, the first one of the session that follows
  LevelGaussian T_MF;   ///< in the M of the component of `anchor`; the yaw is not known
};

/// T_Mb as an anchor sees it: the anchor's own error in M does not count.
LevelGaussian bodyByGraph(const Whereabouts& body, const LevelGaussian& T_ba);

/// Anchors of earlier visits, nearest first, with their distance in the plane, as far as the body
/// may be off. How far that is, is asked of the first anchor of its component: nearer ones are
/// known better.
std::vector<std::pair<double, AnchorId>> anchorsOfBefore(const Whereabouts& body,
                                                         const Parameters& parameters);

class LoopSearch {
 public:
  explicit LoopSearch(const Parameters& parameters) : parameters_(parameters) {}

  struct Found {
    PlaceMatch match;                    ///< T_MB in the M of the component that it is found in
    AnchorId home = 0;                   ///< to which most of the known objects belong
    std::optional<LevelGaussian> prior;  ///< by odometry and graph; nothing: it was nowhere known
    double sigma_m = 0.0;                ///< deviation of the prior in the plane
  };

  /// Among what hangs together with the body by the graph. Returns what is believed.
  std::optional<Found> nearby(const Whereabouts& body) const;
  /// In the components of the graph that the body's session does not hang together with.
  std::optional<Found> elsewhere(const Whereabouts& body);
  /// In the component of the session that ended, around the place where it ended. Returns a match
  /// that needs no second search.
  std::optional<Found> nearLast(const Whereabouts& body, const LastPlace& last) const;
  /// The graph or the objects of other components have changed.
  void forget() { others_.clear(); }

 private:
  std::vector<PlacedObject> seenOfLate(const Whereabouts& body) const;
  struct Around {
    std::vector<PlacedObject> objects;
    std::map<ObjectId, AnchorId> homes;
    std::vector<Eigen::Vector2d> driven;
    std::optional<LevelGaussian> nearest;  ///< T_ba of its nearest place
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
