// The belief of semantic_filter (eq. 4, 8, 9): existence × PMF over classes × bank of Gaussians.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/ids.h"
#include "common/math/rigid_transform.h"
#include "common/types/description.h"
#include "common/types/detections.h"
#include "common/types/directions.h"
#include "common/types/ledger.h"

namespace perdure {

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

/// "other": a real, persistent object of no known class (k = 0).
inline constexpr char kOtherClass[] = "other";

/// One EKF of the bank: p(x | class), x = [p_WO (centre), yaw, log length, log width, log height].
struct ClassBelief {
  std::string name;          ///< lower-case, or kOtherClass
  double probability = 0.0;  ///< π_k; the sum over an object's classes is 1
  Vector7d mean = Vector7d::Zero();
  Matrix7d covariance = Matrix7d::Identity();
  Eigen::Matrix<double, 7, 6> cross_pose = Eigen::Matrix<double, 7, 6>::Zero();  ///< P_xg
};

enum class Visibility : std::uint8_t {
  kVisible = 0,
  kPartial = 1,
  kOccluded = 2,
  kOutOfView = 3,  ///< in front of the camera, but outside the image
  kBehind = 4,
};

enum class Memory : std::uint8_t { kWorking = 0, kLongTerm = 1 };

struct ObjectBelief {
  ObjectId id = 0;
  TrackId track = 0;       ///< 0: the same as id
  double existence = 0.0;  ///< r in [0, 1]
  bool confirmed = false;
  std::vector<ClassBelief> classes;  ///< not empty; ordered by decreasing probability
  Visibility visibility = Visibility::kVisible;
  double visible_fraction = 0.0;           ///< v in [0, 1]
  ObjectId blocked_by = 0;                 ///< the occluding object; 0: none, or not an object
  TimePoint first_seen, last_seen, as_of;  ///< as_of: time up to which process noise was added
  std::uint32_t hits = 0, visible_misses = 0;
  double moving = 0.0;                                 ///< probability that the object moves
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s in W, zero while static
  Memory memory = Memory::kWorking;
  bool recalled = false;                      ///< recalled from the map and not detected since
  Directions seen_from = Directions::Zero();  ///< in W; 0 everywhere: not known
  Ledger why;                                 ///< reasons of existence and class probabilities

  const ClassBelief& best() const { return classes.front(); }
  TrackId trackId() const { return track != 0 ? track : id; }
};

/// A published track that was merged, or a confirmed one that is gone.
struct EndedTrack {
  TrackId track = 0;
  TrackId into = 0;  ///< the track that it was merged into; 0: the object is gone
  TimePoint time;
  bool operator==(const EndedTrack&) const = default;
};

/// The working set at one frame, sufficient to restore it. It is complete: a later message replaces
/// it.
struct Objects {
  FrameStamp stamp;
  InstanceId instance = 0;
  WorldId world;
  RigidTransform T_WB;  ///< the pose used for visibility
  Eigen::Vector3d up_W = Eigen::Vector3d::UnitZ();
  ObjectId next_id = 1;  ///< smaller ids are in use
  std::vector<ObjectBelief> objects;
  /// Covariance of [θ, p] as in Odometry, to which `cross_pose` of objects detected in this frame
  /// refers. Zero: not known.
  Eigen::Matrix<double, 6, 6> pose_error = Eigen::Matrix<double, 6, 6>::Zero();
  /// Source and revision of the newest `map/near` in use; 0: none.
  InstanceId near_source = 0;
  std::uint64_t near_revision = 0;
  /// The map must send the objects nearer to the body than this, m; 0: none.
  double near_m = 0.0;
  std::vector<EndedTrack> ended;  ///< tracks that ended after MapNear::kept; at most kMostEnded
  /// The filter's own beliefs of the objects that corrections of people change (corrections.h).
  std::vector<ObjectBelief> as_estimated;
};
inline constexpr std::size_t kMostEnded = 256;

/// The newest state of one object of the working set. Latched on `object_state`, keyed by the
/// object's id. It is disposed of when the object leaves the working set: gone, merged into
/// another, or archived. An archived object remains on the map. Events state the cause.
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
  kLoopClosed,     ///< this event and the next two come from the map's graph
  kLoopWithdrawn,  ///< a loop closure was retracted
  kRelocalised,    ///< a session was located on an earlier map
};
const char* nameOf(EventKind kind);    ///< "born", "class_resolved", …
const char* nameOf(Visibility value);  ///< "visible", "out_of_view", …

struct Event {
  FrameStamp stamp;
  InstanceId instance = 0;
  WorldId world;
  EventKind kind = EventKind::kBorn;
  ObjectId object_id = 0;
  ObjectId other_id = 0;     ///< the occluding object, or the absorbed id
  std::string class_name;    ///< class of the object at that time
  double probability = 0.0;  ///< the probability concerned: r, or π of the class
  std::string detail;
  /// For kPredictedReturn: the expected value and the ends of a 90 % interval, in seconds after the
  /// stamp.
  std::array<double, 3> returns_in_s{};
};

/// The expected box of an object in a coming frame, for top-down detection by inference.
struct Prediction {
  ObjectId object_id = 0;
  std::string class_name;
  Box box;
  double probability = 0.0;  ///< r·π·v
  /// Velocity of the sides x1, y1, x2, y2, in pixels per second, to predict the box in a later
  /// frame.
  std::array<double, 4> velocity{};
  /// Standard deviation of each side in pixels; 0: not known.
  std::array<double, 4> side_sigma{};
};
struct Predictions {
  FrameStamp stamp;
  InstanceId instance = 0;
  std::string camera;
  std::vector<Prediction> predictions;
};

}  // namespace perdure

namespace perdure::wire {

void describe(auto& a, Is<ClassBelief> auto& d, auto& w) {
  a.name("name", d.name, w.name);
  a.probability("probability", d.probability, w.probability);
  a.matrix("mean", d.mean, w.mean, kCoordinate);
  a.covariance("covariance", d.covariance, w.covariance);
  a.matrix("cross_pose", d.cross_pose, w.cross_pose, kMatrixEntry);
}

/// The ledger's fields are members of the belief on the wire (reason: idl/README.md).
template <class D>
bool sumsToOne(const D& classes) {
  double sum = 0;
  for (const auto& c : classes) sum += c.probability;
  return !classes.empty() && sum > 1 - kUnitTolerance && sum < 1 + kUnitTolerance;
}

void describe(auto& a, Is<ObjectBelief> auto& d, auto& w) {
  a.value("id", d.id, w.object_id);
  a.ensure("id", "out_of_range", [&] { return d.id != 0; });
  a.probability("existence", d.existence, w.existence);
  a.value("confirmed", d.confirmed, w.confirmed);
  a.list("classes", d.classes, w.classes, kClasses + 1);
  a.ensure("classes", "bad_probabilities", [&] { return sumsToOne(d.classes); });
  a.choice("visibility", d.visibility, w.visibility, Visibility::kBehind);
  a.probability("visible_fraction", d.visible_fraction, w.visible_fraction);
  a.value("blocked_by", d.blocked_by, w.blocked_by);
  a.time("first_seen_ns", d.first_seen, w.first_seen_ns);
  a.time("last_seen_ns", d.last_seen, w.last_seen_ns);
  a.time("as_of_ns", d.as_of, w.as_of_ns);
  a.value("hits", d.hits, w.hits);
  a.value("visible_misses", d.visible_misses, w.visible_misses);
  a.probability("moving", d.moving, w.moving);
  a.matrix("velocity", d.velocity, w.velocity, kSpeed);
  a.choice("memory", d.memory, w.memory, Memory::kLongTerm);
  a.value("recalled", d.recalled, w.recalled);
  a.object("why", d.why, w);
  a.value("track", d.track, w.track);
  a.matrix("seen_from", d.seen_from, w.seen_from, kNotNegative);
}

void describe(auto& a, Is<EndedTrack> auto& d, auto& w) {
  a.value("track", d.track, w.track);
  a.value("into", d.into, w.into);
  a.time("time_ns", d.time, w.time_ns);
  a.ensure("track", "out_of_range", [&] { return d.track != 0 && d.track != d.into; });
}

void describe(auto& a, Is<Objects> auto& d, auto& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.object("world", d.world, w.reference);
  a.pose("T_WB", d.T_WB, w.T_WB);
  a.unit("up_W", d.up_W, w.up_W);
  a.value("next_id", d.next_id, w.next_object_id);
  a.list("objects", d.objects, w.items, kObjects);
  a.symmetric("pose_error", d.pose_error, w.pose_error);
  a.value("near_source", d.near_source, w.near_source);
  a.value("near_revision", d.near_revision, w.near_revision);
  a.number("near_m", d.near_m, w.near_m, kNotNegative);
  a.list("ended", d.ended, w.ended, kMostEnded);
  a.list("as_estimated", d.as_estimated, w.as_estimated, kObjects);
}

void describe(auto& a, Is<ObjectState> auto& d, auto& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.object("world", d.world, w.reference);
  a.object("object", d.object, w.belief);
  a.value("id", d.object.id, w.object_id);  // the key, the only field in a dispose
  a.ensureWire("id", "size_mismatch", [&] { return w.object_id == w.belief.object_id; });
}

void describe(auto& a, Is<Event> auto& d, auto& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.object("world", d.world, w.reference);
  a.choice("kind", d.kind, w.kind, EventKind::kRelocalised);
  a.value("object_id", d.object_id, w.object_id);
  a.value("other_id", d.other_id, w.other_id);
  a.text("class_name", d.class_name, w.class_name, kNameLength);
  a.probability("probability", d.probability, w.probability);
  a.text("detail", d.detail, w.detail, kTextLength);
  a.number("returns_in", d.returns_in_s[0], w.returns_in[0], kNotNegative);
  a.number("returns_earliest", d.returns_in_s[1], w.returns_in[1], kNotNegative);
  a.number("returns_latest", d.returns_in_s[2], w.returns_in[2], kNotNegative);
}

void describe(auto& a, Is<Prediction> auto& d, auto& w) {
  a.value("object_id", d.object_id, w.object_id);
  a.text("class_name", d.class_name, w.class_name, kNameLength);
  describeBox(a, d.box, w.corners);
  a.probability("probability", d.probability, w.probability);
  a.number("velocity_x1", d.velocity[0], w.velocity[0], kPixel);
  a.number("velocity_y1", d.velocity[1], w.velocity[1], kPixel);
  a.number("velocity_x2", d.velocity[2], w.velocity[2], kPixel);
  a.number("velocity_y2", d.velocity[3], w.velocity[3], kPixel);
  a.number("sigma_x1", d.side_sigma[0], w.side_sigma[0], kNotNegative);
  a.number("sigma_y1", d.side_sigma[1], w.side_sigma[1], kNotNegative);
  a.number("sigma_x2", d.side_sigma[2], w.side_sigma[2], kNotNegative);
  a.number("sigma_y2", d.side_sigma[3], w.side_sigma[3], kNotNegative);
}

void describe(auto& a, Is<Predictions> auto& d, auto& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.text("camera", d.camera, w.camera, kNameLength);
  a.list("predictions", d.predictions, w.items, kObjects);
}

}  // namespace perdure::wire
