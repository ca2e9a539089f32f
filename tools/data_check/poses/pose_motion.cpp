// Compares the motion of given poses with the drive. Finds poses of the camera, and poses that are
// constant while the body moves.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/base/algorithms/median.h"
#include "tools/data_check/motion_in.h"
#include "tools/data_check/poses/pose_check.h"

namespace perdure::tools {
namespace {

using replay::DataFinding;
using replay::DataFindings;
using replay::StampedPose;
using Grade = DataFinding::Grade;
using Poses = std::vector<StampedPose>;

/// The mean direction of travel in the body frame of the poses, over steps of a metre. Its length
/// is 1 for a constant direction. Zero for fewer than `fewest` steps.
Eigen::Vector3d courseOf(const Poses& poses, double fewest) {
  constexpr double kStep_m = 1.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (std::size_t i = 0, from = 0; i < poses.size(); ++i) {
    const Eigen::Vector3d step = poses[i].T_WB.p - poses[from].T_WB.p;
    if (step.norm() < kStep_m) continue;
    sum += poses[from].T_WB.q.conjugate() * step.normalized();
    from = i, count += 1.0;
  }
  return count < fewest ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : Eigen::Vector3d(sum / count);
}

/// How constant the direction of a body axis is in the world: 1 is constant, 0 is random.
double constancyOf(const Eigen::Vector3d& axis, const Poses& poses) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const StampedPose& pose : poses) sum += pose.T_WB.q * axis;
  return sum.norm() / static_cast<double>(poses.size());
}

struct Still {
  std::size_t first, last;
};

using AreSame = bool (*)(const RigidTransform&, const RigidTransform&);

bool areSamePlaces(const RigidTransform& a, const RigidTransform& b) {
  return (b.p - a.p).norm() <= 1e-4;  // m
}
bool areSameTurns(const RigidTransform& a, const RigidTransform& b) {
  return a.q.angularDistance(b.q) <= 1e-4;  // rad
}
bool areSamePoses(const RigidTransform& a, const RigidTransform& b) {
  return areSamePlaces(a, b) && areSameTurns(a, b);
}

/// The intervals of 0.4 s or more, but not the whole drive, in which poses are the same; the
/// longest first.
std::vector<Still> stillParts(const Poses& poses, AreSame are_same) {
  constexpr Duration kLeast = std::chrono::milliseconds(400);
  constexpr std::size_t kFewest = 3;
  std::vector<Still> parts;
  for (std::size_t from = 0, to = 0; from < poses.size(); from = to + 1) {
    to = from;
    while (to + 1 < poses.size() && are_same(poses[from].T_WB, poses[to + 1].T_WB)) ++to;
    const bool whole = from == 0 && to + 1 == poses.size();
    if (whole || to - from < kFewest || poses[to].time - poses[from].time < kLeast) continue;
    parts.push_back({from, to});
  }
  std::stable_sort(parts.begin(), parts.end(), [&](const Still& a, const Still& b) {
    return poses[a.last].time - poses[a.first].time > poses[b.last].time - poses[b.first].time;
  });
  return parts;
}

/// What moves while the poses are still: the gyroscope, the speed or the images; else nothing.
std::string movingIn(const replay::Recording& recording, TimePoint from, TimePoint to,
                     AreSame are_same, bool images) {
  constexpr double kTurns_rad = 0.02, kMoves_mps = 0.5, kFlows_px = 2.0;
  if (are_same != areSamePlaces && turningIn(recording, from, to) > kTurns_rad) {
    return "the gyroscope turns";
  }
  if (are_same == areSameTurns) return {};
  if (const double speed = speedIn(recording, from, to); speed > kMoves_mps) {
    return fmt::format("the speed is {:.1f} m/s", speed);
  }
  const bool flows = images && are_same == areSamePoses && flowIn(recording, from, to) > kFlows_px;
  return flows ? "the images move" : "";
}

/// What the positions do after they were still, if they make up for it at once; else nothing.
std::string catchingUp(const Poses& poses, const Still& still) {
  constexpr double kMoves_mps = 0.5, kTimes = 3.0;
  if (still.last + 2 >= poses.size()) return {};
  const StampedPose &from = poses[still.last], &to = poses[still.last + 1],
                    &next = poses[still.last + 2];
  const double step = (to.T_WB.p - from.T_WB.p).norm();
  const double speed = (next.T_WB.p - to.T_WB.p).norm() / toSeconds(next.time - to.time);
  const bool fast = step > kMoves_mps * toSeconds(from.time - poses[still.first].time);
  if (!fast || step < kTimes * speed * toSeconds(to.time - from.time)) return {};
  return fmt::format("and go on {:.2g} m away", step);
}

/// The speed beside a still part, if it stops or starts harder than any body does; else 0. `end` is
/// the first or last pose of the part, `step` leads out of it.
double speedAtOnce(const Poses& poses, std::size_t end, std::ptrdiff_t step) {
  constexpr double kHardest_mps2 = 20.0, kLeast_s = 0.1;
  constexpr std::ptrdiff_t kFewest = 3;
  auto at = static_cast<std::ptrdiff_t>(end);
  const auto size = static_cast<std::ptrdiff_t>(poses.size());
  const auto passed = [&] {
    return std::abs(toSeconds(poses[static_cast<std::size_t>(at)].time - poses[end].time));
  };
  for (std::ptrdiff_t count = 0; count < kFewest || passed() < kLeast_s; ++count) {
    at += step;
    if (at < 0 || at >= size) return 0.0;
  }
  const Eigen::Vector3d way = poses[static_cast<std::size_t>(at)].T_WB.p - poses[end].T_WB.p;
  const double speed = way.norm() / passed();
  return speed > kHardest_mps2 * passed() / 2.0 ? speed : 0.0;
}

/// The motion beside a still part, if positions stop and start harder than any body does; else
/// nothing.
std::string stoppingAtOnce(const Poses& poses, const Still& still) {
  const double before = speedAtOnce(poses, still.first, -1),
               after = speedAtOnce(poses, still.last, 1);
  const bool from_start = still.first == 0, to_end = still.last + 1 == poses.size();
  if ((before == 0.0 && !from_start) || (after == 0.0 && !to_end)) return {};
  return fmt::format("and move at {:.1f} m/s beside that, without braking",
                     std::max(before, after));
}

/// The evidence that a still part is not a rest; else nothing.
std::string whyNoRest(const Poses& poses, const Still& still, AreSame are_same,
                      const replay::Recording& recording, bool images) {
  // At an end of the poses, a rest with other stamps looks like a part that stands still.
  const bool at_end = still.first == 0 || still.last + 1 == poses.size();
  if (!at_end || are_same == areSamePoses) {
    const std::string moves =
        movingIn(recording, poses[still.first].time, poses[still.last].time, are_same, images);
    if (!moves.empty()) return "while " + moves;
  }
  if (are_same == areSameTurns) return {};
  const std::string on = catchingUp(poses, still);
  return on.empty() ? stoppingAtOnce(poses, still) : on;
}

}  // namespace

DataFindings judgePosesOfCamera(const Poses& poses, const replay::Recording& recording) {
  constexpr double kCourse = 0.95, kTurned_rad = 0.2, kAlong = 0.9, kAsConstant = 0.01;
  if (poses.empty() || recording.calibration.cameras.empty()) return {};
  const CameraCalibration& camera = recording.calibration.cameras.front();
  const Eigen::Vector3d course = courseOf(poses, 20.0), down = Eigen::Vector3d::UnitY();
  if (course.norm() < kCourse || Eigen::AngleAxisd(camera.T_BC.q).angle() < kTurned_rad) return {};
  const Eigen::Vector3d as_body = camera.T_BC.q.conjugate() * course;
  if (std::abs(course.z()) < kAlong || std::abs(as_body.y()) < kAlong) return {};
  if (constancyOf(down, poses) + kAsConstant < constancyOf(camera.T_BC.q * down, poses)) return {};
  return {{Grade::kFatal, "poses_of_camera",
           fmt::format("by the poses {} moves {} all the time, and along its own axis where they "
                       "are read as those of the camera (z forward, y down), whose y also stays "
                       "upright: give --odometry-of camera, or T_WB, which is T_WC times the "
                       "inverse of T_BS",
                       camera.name, as_body.y() < 0 ? "upwards" : "downwards")}};
}

DataFindings judgePosesBackwards(const Poses& poses, const replay::Recording& recording) {
  constexpr double kBackwards = -0.95, kForwards_mps = 1.0;
  std::vector<double> speeds;
  for (const SpeedSample& sample : recording.speed) {
    const bool within =
        !poses.empty() && sample.time >= poses.front().time && sample.time <= poses.back().time;
    if (within) speeds.push_back(sample.speed);
  }
  const double speed = medianOf(std::move(speeds));
  if (courseOf(poses, 5.0).x() > kBackwards || speed < kForwards_mps) return {};
  return {{Grade::kWarning, "poses_backwards",
           fmt::format("the poses move backwards all the time while the speed is {:.1f} m/s: they "
                       "are inverted (the world in the body), or their x axis is not forward",
                       speed)}};
}

DataFindings judgePosesFrozen(const Poses& poses, const replay::Recording& recording, bool images) {
  if (recording.calibration.cameras.empty()) return {};
  constexpr std::pair<AreSame, const char*> kParts[] = {
      {areSamePoses, "poses stand"},
      {areSamePlaces, "positions of the poses stand"},
      {areSameTurns, "orientations of the poses stand"}};
  for (const auto& [are_same, what] : kParts) {
    constexpr std::size_t kShown = 3;  // images are compared in so many parts, because that is slow
    const auto parts = stillParts(poses, are_same);
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const Still& still = parts[k];
      const std::string why = whyNoRest(poses, still, are_same, recording, images && k < kShown);
      if (why.empty()) continue;
      const TimePoint from = poses[still.first].time, to = poses[still.last].time;
      return {{Grade::kWarning, "poses_frozen",
               fmt::format("the {} still from {} to {} ns ({:.1f} s, poses {} to {} of them) {}: "
                           "a tracker that is lost repeats its last pose; leave those lines out",
                           what, toNanoseconds(from), toNanoseconds(to), toSeconds(to - from),
                           still.first + 1, still.last + 1, why)}};
    }
  }
  return {};
}

}  // namespace perdure::tools
