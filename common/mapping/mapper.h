// The map as one map: anchors along the way, the pose graph over them, the objects that belong to
// them, and the loops that are found by objects. It hears odometry and the working set, and says
// where objects of earlier visits lie now, which of them are one, and how W lies in M.
//
// No files, threads or clock. The same messages in the same order give the same map.
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

/// A loop that was told, and that later ones contradict.
struct LoopWithdrawal {
  EdgeId id = 0;
  AnchorId a = 0, b = 0;
  Edge edge;                                              ///< as it was
  std::vector<std::pair<ObjectId, ObjectId>> pairs = {};  ///< that it found to be one: known, seen
  std::size_t points = 0;                                 ///< landmarks by which it was found
};

/// What has changed since it was asked for last.
struct MapChange {
  std::vector<LoopClosure> loops;
  std::vector<SameObject> facts;   ///< of these loops: a was known, b was seen as new
  std::vector<MergeOrder> merges;  ///< the objects that have become one by them
  std::vector<LoopWithdrawal> withdrawn;
  std::vector<MergeOrder> splits;  ///< the objects that are two again

  bool empty() const { return loops.empty() && withdrawn.empty(); }
};

/// An object of the map that lies near the body.
struct Recallable {
  ObjectId id = 0;
  TrackId track = 0;  ///< under which it was detected last
  /// Maps what is stored of it in its session's W into today's W; nothing: it is in today's W, and
  /// its relation to the body is the odometry's own.
  std::optional<RigidTransform> T_now;
  /// Of the error of T_now: [δp, δyaw] in W, turning about `about_W`.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  Eigen::Vector3d about_W = Eigen::Vector3d::Zero();  ///< the object's anchor
  Matrix6d pose_error = Matrix6d::Zero();             ///< of the body when it was last detected
};

class Mapper {
 public:
  /// `saved`: what was known at the last end.
  explicit Mapper(const Parameters& parameters, SavedMap saved = {});

  /// Poses come before the working set of the same frame.
  void onOdometry(const Odometry& odometry);
  void onObjects(const Objects& objects);
  /// What the places of the way look like. May be left out: then objects alone say where it is.
  void onLandmarks(const Landmarks& landmarks);
  /// The filter has merged two confirmed tracks, or has deleted one.
  void onMerged(TrackId survivor, TrackId absorbed);
  void onGone(TrackId id);
  /// Drives along a saved session again and looks for its places among what other sessions have
  /// seen, with what was seen a little later, too. For maps that are brought together. Afterwards
  /// the mapper stands at its end.
  void replay(const WorldId& session);
  MapChange takeChange() { return std::exchange(change_, {}); }

  /// Whether it hears the odometry of this frame of reference.
  bool follows(const WorldId& world) const { return session_ == world && builder_.last(); }

  /// Objects within radius_m of a place in W whose place relative to the body is known well enough
  /// to be taken for what is seen there.
  std::vector<Recallable> near(const Eigen::Vector3d& centre_W, double radius_m);
  /// The same of one track as it was detected last; nothing if its place is not known well enough.
  std::optional<Recallable> placeOf(TrackId track);

  /// Whether the object belongs to an anchor.
  bool holds(ObjectId id) const;
  /// Its record, if it belongs to one.
  const ObjectRecord* recordOf(ObjectId id) const;

  const Identity& identity() const { return state_.identity(); }
  /// Tracks whose object has changed since markSaved(), or that share it now, or no longer.
  const std::set<TrackId>& regrouped() const { return state_.regrouped(); }

  /// What is to be saved, and that it has been.
  Unsaved unsaved() const { return state_.unsaved(); }
  void markSaved() { state_.markSaved(); }

  /// How today's W lies in M beside the body.
  RigidTransform T_MW() const;
  /// All of that frame: nothing before the first pose.
  struct Frame {
    WorldId map;  ///< M: W of the first session of the component
    RigidTransform T_MW;
    Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< of the body in M, [δp, δyaw]
    std::uint32_t sessions = 0;                            ///< of the component
    std::uint32_t loops = 0;                               ///< believed, of all
  };
  std::optional<Frame> frame();
  /// The same along the way of a session, at each anchor.
  struct Along {
    TimePoint time;
    RigidTransform T_MW;
  };
  std::vector<Along> along(const WorldId& session) const;

  /// A loop or tie that is in the graph.
  struct Loop {
    EdgeId id = 0;
    Edge edge;
    double weight = 1.0;
    bool told = false;  ///< a loop waits until the graph believes it; a tie is never told
    std::vector<std::pair<ObjectId, ObjectId>> pairs = {};  ///< known, seen; empty: not known
    std::size_t points = 0;
  };
  std::vector<Loop> loops() const;
  /// Of every anchor as Marginals::variances has it; nothing without anchors.
  std::map<AnchorId, Eigen::Vector4d> variances();
  /// How many objects of the map were last seen from an anchor.
  std::size_t objectsOf(AnchorId anchor) const;
  /// The newest anchor of a session; of any session where that has none.
  std::optional<AnchorId> newestAnchor(const WorldId& session) const;

  const PoseGraph& graph() const { return state_.graph(); }
  const std::map<AnchorId, Anchor>& anchors() const { return state_.anchors(); }
  std::uint64_t revision() const { return revision_; }

 private:
  void begin(const Odometry& odometry);
  void dropTentativeLoops();
  Whereabouts body();
  void see(const ObjectBelief& belief, const Objects& objects);
  PlacedObject placedOf(const ObjectBelief& belief, const Matrix6d& pose_error);
  bool isOld(const ObjectRecord& record) const;
  void forgetUnconfirmed();
  void learnAnew(const WorldId& session);
  void stand(const Anchor& anchor);
  void tie();
  void search();
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
  bool isAgreedOn(const LoopSearch::Found& found);
  void close(const LoopSearch::Found& found);
  void learnDrift(const PlaceMatch& match, const LevelGaussian& prior);
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
  DriftScale drift_scale_;
  double odometry_variance_ = 1.0;  ///< by which the session's odometry edges are multiplied
  std::optional<WorldId> session_;
  std::unique_ptr<Marginals> marginals_;  ///< from the newest anchor
  MapChange change_;
  /// The newest loop. One that rests on the same objects takes its place.
  struct ActiveLoop {
    EdgeId id = 0;
    std::set<std::pair<ObjectId, ObjectId>> pairs;
  };
  std::optional<ActiveLoop> active_;
  /// Where a session that belongs to nothing lies by one search.
  struct Tentative {
    LevelPose T_MN;
    AnchorId component = 0;
    double way_m = 0.0;
  };
  std::optional<Tentative> tentative_;
  /// Where the session before ended, until this one is connected with it.
  struct Ended {
    AnchorId anchor = 0, begins = 0;  ///< its newest one, and the first one of this session
    LevelPose T_AB;                   ///< the body beside its newest anchor
    double sigma_m = 0.0;             ///< of the place at which this session begins
  };
  std::optional<Ended> ended_;
  struct Moment {
    TimePoint time;
    double speed = 0.0;  ///< m/s
  };
  std::optional<Moment> newest_odometry_;
  bool replays_ = false;
  AnchorId looked_from_ = 0;  ///< the anchor whose view was searched last
  std::size_t seen_ = 0, searched_with_ = 0;  ///< objects of the session; those at the last search
  double searched_at_m_ = 0.0, searched_elsewhere_at_m_ = 0.0, learned_at_m_ = 0.0;
  std::uint64_t revision_ = 0;
};

}  // namespace perdure::mapping
