// What semantic_filter believes (eq. 4, 8, 9): existence × PMF over classes × bank of Gaussians.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/ids.h"
#include "common/math/rigid_transform.h"
#include "common/types/detections.h"
#include "common/types/ledger.h"

namespace perdure {

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

/// "other": a real, persistent thing of no known class (k = 0).
inline constexpr char kOtherClass[] = "other";

/// One EKF of the bank: p(x | class), x = [p_WO (centre), yaw, log length, log width, log height].
struct ClassBelief {
  std::string name;          ///< lower-case, or kOtherClass
  double probability = 0.0;  ///< π_k; they sum to 1 over an object's classes
  Vector7d mean = Vector7d::Zero();
  Matrix7d covariance = Matrix7d::Identity();
  Eigen::Matrix<double, 7, 6> cross_pose = Eigen::Matrix<double, 7, 6>::Zero();  ///< P_xg
};

enum class Visibility : std::uint8_t {
  kVisible = 0,
  kPartial = 1,
  kOccluded = 2,
  kOutOfView = 3,  ///< in front, outside the image
  kBehind = 4,
};

enum class Memory : std::uint8_t { kWorking = 0, kLongTerm = 1 };

struct ObjectBelief {
  ObjectId id = 0;
  TrackId track = 0;       ///< 0: the same as id
  double existence = 0.0;  ///< r in [0, 1]
  bool confirmed = false;
  std::vector<ClassBelief> classes;  ///< not empty; the most probable first
  Visibility visibility = Visibility::kVisible;
  double visible_fraction = 0.0;           ///< v in [0, 1]
  ObjectId blocked_by = 0;                 ///< 0: nothing, or not an object
  TimePoint first_seen, last_seen, as_of;  ///< as_of: up to when process noise was applied
  std::uint32_t hits = 0, visible_misses = 0;
  double moving = 0.0;                                 ///< probability that it moves
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s in W, zero while static
  Memory memory = Memory::kWorking;
  bool recalled = false;  ///< came back from the map and not yet seen again
  Ledger why;             ///< what existence and the classes' probabilities are made of

  const ClassBelief& best() const { return classes.front(); }
  TrackId trackId() const { return track != 0 ? track : id; }
};

/// A confirmed track that ended.
struct EndedTrack {
  TrackId track = 0;
  TrackId into = 0;  ///< the track that it was merged into; 0: the object is gone
  TimePoint time;
  bool operator==(const EndedTrack&) const = default;
};

/// The working set at one frame: enough to restore it. Complete: a later one replaces it.
struct Objects {
  FrameStamp stamp;
  InstanceId instance = 0;
  WorldId world;
  RigidTransform T_WB;  ///< the pose that visibility was computed with
  Eigen::Vector3d up_W = Eigen::Vector3d::UnitZ();
  ObjectId next_id = 1;  ///< ids below it were given out
  std::vector<ObjectBelief> objects;
  /// Of [θ, p] as in Odometry: what `cross_pose` of objects detected in this frame refers to. Zero:
  /// not known.
  Eigen::Matrix<double, 6, 6> pose_error = Eigen::Matrix<double, 6, 6>::Zero();
  /// The newest `map/near` that was used; 0: none.
  InstanceId near_source = 0;
  std::uint64_t near_revision = 0;
  /// The map is to give what is nearer to the body than this, m; 0: nothing.
  double near_m = 0.0;
  std::vector<EndedTrack> ended;  ///< after MapNear::kept; at most kMostEnded
};
inline constexpr std::size_t kMostEnded = 256;

/// The newest state of one object of the working set; latched on `object_state`, keyed by its id,
/// and disposed when the object leaves it: gone, merged away, or archived (it is then on the map;
/// the events say which).
struct ObjectState {
  FrameStamp stamp;
  InstanceId instance = 0;
  WorldId world;
  ObjectBelief object;
};

enum class EventKind : std::uint8_t {
  kBorn = 0,
  kConfirmed,
  kClassResolved,
  kOccluded,
  kLeftView,
  kReappeared,
  kMerged,
  kArchived,
  kRecalled,
  kMissing,
  kGone,
  kMoved,
  kPredictedReturn,
  kModelChanged,
  kRestored,
  kLoopClosed,     ///< by the map's graph; so are the two below
  kLoopWithdrawn,  ///< what a loop had said is taken back
  kRelocalised,    ///< a session was found on a map of before
};
const char* nameOf(EventKind kind);    ///< "born", "class_resolved", …
const char* nameOf(Visibility value);  ///< "visible", "out_of_view", …

struct Event {
  FrameStamp stamp;
  InstanceId instance = 0;
  WorldId world;
  EventKind kind = EventKind::kBorn;
  ObjectId object_id = 0;
  ObjectId other_id = 0;     ///< the blocker, or the id that was merged away
  std::string class_name;    ///< of the object at that time
  double probability = 0.0;  ///< what the event is about: r, or π of the class
  std::string detail;
  /// Of kPredictedReturn: seconds after the stamp, expected, and the ends of a 90 % interval.
  std::array<double, 3> returns_in_s{};
};

/// Where objects should be seen at a coming frame, to prime inference (top-down).
struct Prediction {
  ObjectId object_id = 0;
  std::string class_name;
  Box box;
  double probability = 0.0;  ///< r·π·v
  /// Of the box's sides x1, y1, x2, y2, in pixels a second: where it will be a frame later.
  std::array<double, 4> velocity{};
  /// Standard deviation of each side in pixels; 0 where the writer does not say it.
  std::array<double, 4> side_sigma{};
};
struct Predictions {
  FrameStamp stamp;
  InstanceId instance = 0;
  std::string camera;
  std::vector<Prediction> predictions;
};

}  // namespace perdure
