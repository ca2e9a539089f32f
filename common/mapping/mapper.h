// The map: anchors along the trajectory, their pose graph, the objects that belong to them, and
// loop closures. Inputs are odometry, landmarks and the working set. Outputs are the present
// positions of objects of earlier visits, the tracks that are one object, and the pose of W in M.
//
// The mapper uses no files, threads or clock. The same messages in the same order give the same
// map.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/mapping/appearance/view_builder.h"
#include "common/mapping/frames/anchor_builder.h"
#include "common/mapping/graph/drift_scale.h"
#include "common/mapping/graph/marginals.h"
#include "common/mapping/loop_book.h"
#include "common/mapping/loop_search.h"
#include "common/mapping/map_state.h"
#include "common/mapping/parameters.h"
#include "common/mapping/saved_map.h"
#include "common/mapping/tracked_ties.h"
#include "common/mapping/view_search.h"
#include "common/types/objects.h"

namespace perdure::mapping {

/// An accepted loop closure that later ones contradict.
struct LoopWithdrawal {
  EdgeId id = 0;
  AnchorId a = 0, b = 0;
  Edge edge;                                              ///< at the time of its removal
  std::vector<std::pair<ObjectId, ObjectId>> pairs = {};  ///< objects that it identified: known,
                                                          ///< seen
  std::size_t points = 0;                                 ///< number of landmarks that support it
};

/// Changes since the last call of takeChange.
struct MapChange {
  std::vector<LoopClosure> loops;
  std::vector<SameObject> facts;   ///< from these loop closures; a: known track, b: newly detected
                                   ///< track
  std::vector<MergeOrder> merges;  ///< objects that became one by the facts
  std::vector<LoopWithdrawal> withdrawn;
  std::vector<MergeOrder> splits;  ///< objects that were separated again

  bool empty() const { return loops.empty() && withdrawn.empty(); }
};

/// A map object near the body.
struct Recallable {
  ObjectId id = 0;
  TrackId track = 0;  ///< id of the track that was last detected
  /// Maps the stored belief from its session's W into the present W. Nothing if the belief is in
  /// the present W and the graph has not moved its anchor relative to the body.
  std::optional<RigidTransform> T_now;
  /// Error of T_now: [δp, δyaw] in W, with rotations about `about_W`.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  Eigen::Vector3d about_W = Eigen::Vector3d::Zero();  ///< position of the object's anchor
  Matrix6d pose_error = Matrix6d::Zero();             ///< pose error of the body when it last
                                                      ///< detected the object
};

class Mapper {
 public:
  /// `saved` is the state at the last save.
  explicit Mapper(const Parameters& parameters, SavedMap saved = {});

  /// Processes the odometry of a frame. Must precede the working set of the same frame.
  void onOdometry(const Odometry& odometry);
  void onObjects(const Objects& objects);
  /// Processes landmarks, which show the appearance of places. Without them, only objects locate
  /// the body.
  void onLandmarks(const Landmarks& landmarks);
  /// Processes a merge by the filter. Stores no fact if the absorbed track was never confirmed.
  void onMerged(TrackId survivor, TrackId absorbed, bool confirmed = true);
  /// Processes the deletion of a confirmed track by the filter.
  void onGone(TrackId id);
  /// Adds a correction by a person, or replaces the one with its id, in order to withdraw it.
  void onCorrection(const Correction& correction);
  /// Visits the anchors of a saved session again, and searches at each for loops with other
  /// sessions, including later ones. Map fusion uses this function. Afterwards the mapper is at the
  /// end of the session.
  void replay(const WorldId& session);
  MapChange takeChange() { return std::exchange(change_, {}); }

  /// Whether the present session is `world` and has an anchor.
  bool follows(const WorldId& world) const { return session_ == world && builder_.last(); }

  /// Returns the objects within `radius_m` of a position in W. Leaves out objects whose pose
  /// relative to the body is too uncertain for a recall.
  std::vector<Recallable> near(const Eigen::Vector3d& centre_W, double radius_m);
  /// Returns the same data for one track as last detected; nothing if the track is gone or its pose
  /// is too uncertain.
  std::optional<Recallable> placeOf(TrackId track);

  /// Whether the object is confirmed and belongs to an anchor.
  bool holds(ObjectId id) const;
  /// Returns the record of the object; null if it is not confirmed or does not belong to an anchor.
  const ObjectRecord* recordOf(ObjectId id) const;

  const Identity& identity() const { return state_.identity(); }
  /// Tracks whose object id has changed since markSaved(), or that began or ceased to share an
  /// object.
  const std::set<TrackId>& regrouped() const { return state_.regrouped(); }

  /// unsaved() returns the changes to save. Call markSaved() once they are saved.
  Unsaved unsaved() const { return state_.unsaved(); }
  void markSaved() { state_.markSaved(); }

  /// The pose of the present W in M, near the body.
  RigidTransform T_MW() const;
  /// The transform T_MW with its M and covariance.
  struct Frame {
    WorldId map;  ///< M: W of the first session of the component
    RigidTransform T_MW;
    Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< covariance of the body's pose in M,
                                                           ///< [δp, δyaw]
    std::uint32_t sessions = 0;                            ///< number of sessions in the component
    std::uint32_t loops = 0;                               ///< number of accepted loop closures and
                                                           ///< ties on the whole map
  };
  /// Returns nothing before the first anchor.
  std::optional<Frame> frame();
  /// T_MW near an anchor of a session, at the time of the anchor.
  struct Along {
    TimePoint time;
    RigidTransform T_MW;
  };
  std::vector<Along> along(const WorldId& session) const;

  /// A loop closure or tie in the graph.
  struct Loop {
    EdgeId id = 0;
    Edge edge;
    double weight = 1.0;
    bool told = false;  ///< false while it is tentative; always false for a tie
    std::vector<std::pair<ObjectId, ObjectId>> pairs = {};  ///< known, seen; empty if unknown, or
                                                            ///< if the loop is by landmarks
    std::size_t points = 0;
  };
  std::vector<Loop> loops() const;
  /// Returns the variances of every anchor as Marginals::variances() does; empty if there are no
  /// anchors.
  std::map<AnchorId, Eigen::Vector4d> variances();
  /// Number of map objects that were last detected from an anchor.
  std::size_t objectsOf(AnchorId anchor) const;
  /// The newest anchor of a session; of any session if this one has none.
  std::optional<AnchorId> newestAnchor(const WorldId& session) const;

  const PoseGraph& graph() const { return state_.graph(); }
  const std::map<AnchorId, Anchor>& anchors() const { return state_.anchors(); }
  std::uint64_t revision() const { return revision_; }

 private:
  void begin(const Odometry& odometry);
  void dropTentativeLoops();
  Whereabouts body(double widening = 1.0);
  void see(const ObjectBelief& belief, const Objects& objects);
  PlacedObject placedOf(const ObjectBelief& belief, const Matrix6d& pose_error);
  bool isOld(const ObjectRecord& record) const;
  void forgetUnconfirmed();
  void continueDrift(const WorldId& session);
  void stand(const Anchor& anchor);
  void tie();
  void search();
  std::optional<LoopSearch::Found> searchWidely(const Whereabouts& here);
  std::optional<LoopSearch::Found> searchNearby(const Whereabouts& here, bool new_view);
  std::optional<LoopSearch::Found> searchElsewhere(const Whereabouts& here, bool new_view);
  void rememberLastPlace(const Odometry& next);
  std::optional<LastPlace> lastPlace() const;
  View viewOfNow() const;
  void graphMoved();
  void settle();
  void join(const LoopClosure& loop);
  void withdraw(EdgeId loop);
  void putWitnesses(EdgeId loop, std::vector<std::pair<ObjectId, ObjectId>>& pairs,
                    std::size_t& points) const;
  std::optional<Recallable> relativeTo(const Anchor& here, const Anchor& a);
  Recallable withRecord(Recallable there, ObjectId id, const ObjectRecord& record) const;
  struct Tentative;
  bool isAgreedOn(const LoopSearch::Found& found, std::optional<Tentative>& before,
                  std::size_t other_pairs) const;
  void close(const LoopSearch::Found& found);
  void learnDrift();
  bool restsOnActive(const PlaceMatch& match) const;
  Edge edgeFrom(AnchorId a, AnchorId b, const LevelGaussian& T_Mb, EdgeKind kind) const;
  void bringTogether(const Edge& edge);
  const Marginals& marginals();

  Parameters parameters_;
  MapState state_;
  AnchorBuilder builder_;
  ViewBuilder view_builder_;
  LoopSearch loop_search_;
  ViewSearch view_search_;
  TrackedTies tracked_ties_;
  LoopBook loop_book_;
  DriftVariance odometry_variance_;  ///< factors of the covariances of the session's odometry edges
  /// The largest plausible standard deviation of the odometry's error, relative to the one in use.
  double widening_ = 1.0;
  std::optional<WorldId> session_;
  std::unique_ptr<Marginals> marginals_;  ///< relative to the newest anchor
  MapChange change_;
  /// The newest loop closure. A later one with the same objects replaces it.
  struct ActiveLoop {
    EdgeId id = 0;
    std::set<std::pair<ObjectId, ObjectId>> pairs;
  };
  std::optional<ActiveLoop> active_;
  /// The pose of the session according to one search, until a second search agrees.
  struct Tentative {
    LevelPose T_MN;
    AnchorId component = 0;
    double way_m = 0.0;
    std::set<std::pair<ObjectId, ObjectId>> pairs;
  };
  std::optional<Tentative> tentative_elsewhere_, tentative_widely_;  ///< of searchElsewhere() and
                                                                     ///< searchWidely()
  /// The end of the previous session, until a loop connects this session with the map.
  struct Ended {
    AnchorId anchor = 0, begins = 0;  ///< newest anchor of the previous session, and first one of
                                      ///< this session
    LevelPose T_AB;                   ///< pose of the body relative to that anchor
    double sigma_m = 0.0;             ///< standard deviation of the position where this session
                                      ///< begins
  };
  std::optional<Ended> ended_;
  struct Moment {
    TimePoint time;
    double speed = 0.0;  ///< m/s
  };
  std::optional<Moment> newest_odometry_;
  bool replays_ = false;
  AnchorId looked_from_ = 0;                  ///< the anchor whose view was searched last
  std::size_t seen_ = 0, searched_with_ = 0;  ///< number of objects of the session, now and at the
                                              ///< last search
  double searched_at_m_ = 0.0, searched_widely_at_m_ = 0.0, searched_elsewhere_at_m_ = 0.0,
         learned_at_m_ = 0.0;
  std::uint64_t revision_ = 0;
};

}  // namespace perdure::mapping
