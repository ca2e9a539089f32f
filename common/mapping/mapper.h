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

#include "common/mapping/frames/anchor_builder.h"
#include "common/mapping/graph/drift_scale.h"
#include "common/mapping/graph/marginals.h"
#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/parameters.h"
#include "common/mapping/places/constellation.h"
#include "common/types/objects.h"

namespace perdure::mapping {

/// A loop that was closed.
struct LoopClosure {
  EdgeId id = 0;
  AnchorId a = 0, b = 0;  ///< b: where the body was
  PlaceMatch match;
  double correction_m = 0.0;  ///< how far the body's place in M moved
};

/// What has changed since it was asked for last.
struct MapChange {
  std::vector<LoopClosure> loops;
  std::vector<MergeOrder> merges;
};

/// An object of the map that lies near the body.
struct Recallable {
  ObjectId id = 0;
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
  explicit Mapper(const Parameters& parameters);

  /// Poses come before the working set of the same frame.
  void onOdometry(const Odometry& odometry);
  void onObjects(const Objects& objects);
  void onMerged(ObjectId survivor, ObjectId absorbed);
  void onGone(ObjectId id);
  MapChange takeChange() { return std::exchange(change_, {}); }

  /// Objects within radius_m of a place in W whose place relative to the body is known well enough
  /// to be taken for what is seen there.
  std::vector<Recallable> near(const Eigen::Vector3d& centre_W, double radius_m);

  /// Whether the object belongs to an anchor. What was stored before this process began does not.
  bool holds(ObjectId id) const;

  /// How today's W lies in M beside the body.
  RigidTransform T_MW() const;
  /// The same along the way of a session, at each anchor.
  struct Along {
    TimePoint time;
    RigidTransform T_MW;
  };
  std::vector<Along> along(const WorldId& session) const;

  const PoseGraph& graph() const { return graph_; }
  const std::map<AnchorId, Anchor>& anchors() const { return anchors_; }
  std::uint64_t revision() const { return revision_; }

 private:
  struct Sighting {
    AnchorId anchor = 0;
    PlacedObject in_anchor;
  };
  struct Record {
    WorldId session;
    double way_m = 0.0;  ///< of the session when it was last detected
    TimePoint last_seen;
    Matrix6d pose_error = Matrix6d::Zero();  ///< then
    Sighting sighting;                       ///< the newest
    std::optional<Sighting> earlier;         ///< of the visit before, if it came back
    bool confirmed = false;                  ///< once: it is on the map
  };

  void begin(const Odometry& odometry);
  void see(const ObjectBelief& belief, const Objects& objects);
  bool isOld(const Record& record) const;
  PlacedObject placedOf(const ObjectBelief& belief, const Matrix6d& pose_error);
  std::uint32_t numberOf(const std::string& class_name);
  PlacedObject inM(const Sighting& sighting) const;
  std::vector<PlacedObject> seenOfLate();
  std::optional<LevelGaussian> addMapAround(PlaceQuery& query);
  const Sighting* sightingOfBefore(const Record& record) const;
  void search();
  bool isBelieved(const PlaceMatch& match, double sigma_m) const;
  std::optional<Recallable> relativeTo(const Anchor& here, const Anchor& a);
  /// `prior`: of T_Mb before the loop.
  void close(const PlaceMatch& match, const LevelGaussian& prior);
  void learnDrift(const PlaceMatch& match, const LevelGaussian& prior);
  Edge edgeFrom(AnchorId a, AnchorId b, const LevelGaussian& T_Mb, EdgeKind kind) const;
  void optimise();
  const Marginals& marginals();

  Parameters parameters_;
  AnchorBuilder builder_;
  PoseGraph graph_;
  DriftScale drift_scale_;
  double odometry_variance_ = 1.0;  ///< by which the graph's odometry edges are multiplied
  double learned_at_m_ = 0.0;
  std::map<AnchorId, Anchor> anchors_;
  std::map<ObjectId, Record> records_;
  std::map<std::string, std::uint32_t> class_numbers_;
  std::optional<WorldId> session_;
  AnchorId next_anchor_ = 1;
  std::unique_ptr<Marginals> marginals_;  ///< from the newest anchor
  MapChange change_;
  /// The newest loop. One that rests on the same objects takes its place.
  struct ActiveLoop {
    EdgeId id = 0;
    std::set<std::pair<ObjectId, ObjectId>> pairs;
  };
  std::optional<ActiveLoop> active_;
  double searched_at_m_ = 0.0;
  std::uint64_t revision_ = 0;
};

}  // namespace perdure::mapping
