// Finds implausible poses: without rotation or translation, with jumps, or with positions along
// other axes than the orientations.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "tools/data_check/poses/pose_check.h"
#include "tools/data_check/poses/pose_pushes.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::tools {
namespace {

using replay::DataFinding;
using replay::DataFindings;
using replay::StampedPose;
using Grade = DataFinding::Grade;
using Poses = std::vector<StampedPose>;

/// Converts poses of the first camera to poses of the body.
Poses ofBody(Poses poses, const replay::Recording& recording) {
  const RigidTransform T_CB = recording.calibration.cameras.front().T_BC.inverse();
  for (StampedPose& pose : poses) pose.T_WB = pose.T_WB * T_CB;
  return poses;
}

double secondsBetween(const StampedPose& from, const StampedPose& to) {
  return toSeconds(to.time - from.time);
}

double angleBetween(const StampedPose& a, const StampedPose& b) {
  return a.T_WB.q.angularDistance(b.T_WB.q);
}

/// RMS acceleration of the positions over steps of 1 s; lower is smoother. Empty for few poses.
std::optional<double> roughness(const Poses& poses) {
  constexpr double kStep_s = 1.0;
  constexpr std::size_t kFewest = 8;
  double sum = 0.0;
  std::size_t count = 0, b = 0, c = 0;
  for (std::size_t a = 0; a < poses.size(); ++a) {
    while (b < poses.size() && secondsBetween(poses[a], poses[b]) < kStep_s) ++b;
    if (b == poses.size()) break;
    while (c < poses.size() && secondsBetween(poses[b], poses[c]) < kStep_s) ++c;
    if (c == poses.size()) break;
    const double before = secondsBetween(poses[a], poses[b]),
                 after = secondsBetween(poses[b], poses[c]);
    const Eigen::Vector3d change =
        (poses[c].T_WB.p - poses[b].T_WB.p) / after - (poses[b].T_WB.p - poses[a].T_WB.p) / before;
    sum += (2.0 / (before + after) * change).squaredNorm();
    ++count;
  }
  if (count < kFewest) return std::nullopt;
  return std::sqrt(sum / static_cast<double>(count));
}

/// A jump of the positions or orientations between two neighbours.
struct Jump {
  std::size_t before;  ///< index of the pose before the jump
  double metres, rad;
};

std::vector<Jump> jumpsOf(const Poses& poses) {
  constexpr std::size_t kNeighbours = 10;
  constexpr double kTimes = 10.0, kLeast_m = 1.0, kLeast_rad = 0.35;
  constexpr double kMostAccel = 50.0, kMostTurn = 15.0;  // m/s², rad/s: limits of carried sensors
  std::vector<Jump> jumps;
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    const double metres = (poses[i + 1].T_WB.p - poses[i].T_WB.p).norm();
    const double rad = angleBetween(poses[i], poses[i + 1]);
    const double dt = secondsBetween(poses[i], poses[i + 1]);
    const bool far = metres > kLeast_m && metres > kMostAccel * dt * dt;
    const bool wide = rad > kLeast_rad && rad > kMostTurn * dt;
    if (!far && !wide) continue;
    double speed = 0.0, rate = 0.0;
    std::size_t count = 0;
    for (std::size_t k = i >= kNeighbours ? i - kNeighbours : 0;
         k <= i + kNeighbours && k + 1 < poses.size(); ++k) {
      if (k == i) continue;
      const double step = secondsBetween(poses[k], poses[k + 1]);
      speed = std::max(speed, (poses[k + 1].T_WB.p - poses[k].T_WB.p).norm() / step);
      rate = std::max(rate, angleBetween(poses[k], poses[k + 1]) / step);
      ++count;
    }
    if (count < kNeighbours / 2) continue;
    if ((far && metres > kTimes * speed * dt) || (wide && rad > kTimes * rate * dt)) {
      jumps.push_back({i, metres, rad});
    }
  }
  return jumps;
}

/// Row i: the signed axis of the positions that is axis i of W.
using SignedAxes = Eigen::Matrix3d;

std::vector<SignedAxes> allSignedAxes() {
  std::vector<SignedAxes> all;
  std::array<Eigen::Index, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      SignedAxes axes = SignedAxes::Zero();
      for (Eigen::Index i = 0; i < 3; ++i) {
        axes(i, order[static_cast<std::size_t>(i)]) = (signs >> i & 1) != 0 ? -1.0 : 1.0;
      }
      all.push_back(axes);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return all;
}

/// Correlation with the accelerometer after the positions are rotated by `axes`; 0: none.
double commonOf(std::vector<Push> pushes, const SignedAxes& axes) {
  for (Push& push : pushes) push.by_poses = axes * push.by_poses;
  const auto scale = scaleOf(pushes);
  return scale ? scale->common : 0.0;
}

/// Text such as "-x, y, z", followed by the axes that remain ambiguous.
std::string orderText(const std::vector<SignedAxes>& likely) {
  const SignedAxes& simplest =
      *std::max_element(likely.begin(), likely.end(),
                        [](const auto& a, const auto& b) { return a.trace() < b.trace(); });
  std::string text, unsure;
  for (Eigen::Index row = 0; row < 3; ++row) {
    Eigen::Index column = 0;
    simplest.row(row).cwiseAbs().maxCoeff(&column);
    text += fmt::format("{}{}{}", row == 0 ? "" : ", ", simplest(row, column) < 0 ? "-" : "",
                        "xyz"[column]);
    const bool sure = std::all_of(likely.begin(), likely.end(), [&](const SignedAxes& other) {
      return other.row(row) == simplest.row(row);
    });
    if (!sure) unsure += fmt::format("{}{}", unsure.empty() ? "" : " and ", "xyz"[column]);
  }
  return unsure.empty() ? text
                        : text + fmt::format(" (of {} the drive shows too little to tell)", unsure);
}

/// Converts latitude and longitude in x and y to metres: x to the east, y to the north.
Poses metresOfDegrees(Poses poses, bool latitude_first) {
  constexpr double kMetres = 111'200.0;
  const Eigen::Index lat = latitude_first ? 0 : 1, lon = 1 - lat;
  const Eigen::Vector3d first = poses.front().T_WB.p;
  const double east = kMetres * std::cos(first(lat) * M_PI / 180.0);
  for (StampedPose& pose : poses) {
    const Eigen::Vector3d p = pose.T_WB.p - first;
    pose.T_WB.p = {east * p(lon), kMetres * p(lat), p.z()};
  }
  return poses;
}

std::optional<DataFinding> degrees(const Poses& poses, const replay::Recording& recording,
                                   const std::optional<Scale>& given) {
  constexpr double kCommon = 0.6, kMore = 0.1, kFactor = 2.0, kMostLatitude = 89.0;
  for (const bool latitude_first : {true, false}) {
    const Eigen::Vector3d& p = poses.front().T_WB.p;
    if (std::abs(latitude_first ? p.x() : p.y()) > kMostLatitude) continue;
    if (std::abs(latitude_first ? p.y() : p.x()) > 180.0) continue;
    const auto scale = bestScale(metresOfDegrees(poses, latitude_first), recording);
    if (!scale || scale->common < kCommon) continue;
    if (scale->metres > kFactor || scale->metres < 1.0 / kFactor) continue;
    if (given && given->common + kMore > scale->common) continue;
    return DataFinding{
        Grade::kFatal, "poses_in_degrees",
        fmt::format("x and y of the poses are {}, in degrees, by the accelerometer: give "
                    "positions in metres, in a frame whose axes are those of the orientations "
                    "(east, north, up; UTM is such a one)",
                    latitude_first ? "latitude and longitude" : "longitude and latitude")};
  }
  return std::nullopt;
}

}  // namespace

std::string timesBeside(const replay::Recording& recording, const Poses& poses) {
  const auto span = [](TimePoint first, TimePoint last) {
    return fmt::format("{} … {} ns", toNanoseconds(first), toNanoseconds(last));
  };
  return fmt::format(
      "no frame has a pose: frames are of {}, poses of {}; give poses of this "
      "drive, on the clock of its images",
      span(recording.frames.front().time, recording.frames.back().time),
      span(poses.front().time, poses.back().time));
}

DataFindings judgePoseTimes(const replay::PoseFile& file, const replay::Recording& recording) {
  const Poses& poses = file.poses();
  if (file.format() != replay::PoseFormat::kTum || poses.empty() || recording.frames.empty()) {
    return {};
  }
  if (poses.front().time <= recording.frames.back().time &&
      poses.back().time >= recording.frames.front().time) {
    return {};
  }
  return {{Grade::kFatal, "poses_elsewhere", timesBeside(recording, poses)}};
}

Inversion howInverted(const Poses& poses, const replay::Recording& recording, bool of_camera) {
  constexpr double kCommon = 0.5, kMore = 0.25, kSmoother = 3.0;
  Poses inverse = poses, conjugate = poses;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    inverse[i].T_WB = poses[i].T_WB.inverse();
    conjugate[i].T_WB.q = poses[i].T_WB.q.conjugate();
  }
  if (of_camera && !recording.calibration.cameras.empty()) {
    inverse = ofBody(inverse, recording), conjugate = ofBody(conjugate, recording);
  }
  const auto common = [&](const Poses& some) {
    const auto scale = bestScale(some, recording);
    return scale ? scale->common : 0.0;
  };
  const double of_inverse = common(inverse), of_conjugate = common(conjugate);
  if (std::max(of_inverse, of_conjugate) > kCommon) {
    if (of_inverse > of_conjugate + kMore) return Inversion::kPose;
    if (of_conjugate > of_inverse + kMore) return Inversion::kQuaternion;
  }
  const auto rough_inverse = roughness(inverse), rough_conjugate = roughness(conjugate);
  if (rough_inverse && rough_conjugate) {
    if (*rough_inverse * kSmoother < *rough_conjugate) return Inversion::kPose;
    if (*rough_conjugate * kSmoother < *rough_inverse) return Inversion::kQuaternion;
  }
  return Inversion::kUnsure;
}

DataFindings judgePoseTurning(const Poses& poses, const std::vector<Eigen::Vector3d>& gyro_turns) {
  constexpr double kSame_rad = 1e-3, kTurns_rad = 0.02;
  constexpr std::size_t kFewest = 8;
  if (poses.empty() || gyro_turns.size() < kFewest) return {};
  for (const StampedPose& pose : poses) {
    if (angleBetween(poses.front(), pose) > kSame_rad) return {};
  }
  const TurnPairs turns(gyro_turns, gyro_turns);  // ignores the mean, which may be a bias
  if (turns.turning() < kTurns_rad) return {};
  const double most = turns.reference.colwise().norm().maxCoeff();
  return {{Grade::kFatal, "poses_without_turning",
           fmt::format("the orientations of the poses are all the same while the gyroscope turns "
                       "by up to {:.0f}° in a second: they hold positions alone; give poses with "
                       "the body's orientations",
                       180.0 / M_PI * most)}};
}

DataFindings judgePoseMoving(const Poses& poses, const replay::Recording& recording) {
  // An orientation error tilts gravity: 2 degrees about each axis add 0.4 m/s².
  constexpr double kSame_m = 1e-6, kPushes = 0.2, kSurely = 1.0;
  if (poses.empty()) return {};
  for (const StampedPose& pose : poses) {
    if ((pose.T_WB.p - poses.front().T_WB.p).norm() > kSame_m) return {};
  }
  const double pushes = pushingOfImu(poses, recording);
  if (pushes < kPushes) return {};
  return {{pushes < kSurely ? Grade::kWarning : Grade::kFatal, "poses_without_positions",
           fmt::format("the positions of the poses are all the same while the accelerometer says "
                       "that the body moves (by {:.2f} m/s² over steps of a second): they hold "
                       "orientations alone; give poses with the body's positions",
                       pushes)}};
}

DataFindings judgePoseJumps(const Poses& poses) {
  const auto jumps = jumpsOf(poses);
  if (jumps.empty()) return {};
  const Jump& first = jumps.front();
  const StampedPose &before = poses[first.before], &after = poses[first.before + 1];
  const std::string more =
      jumps.size() == 1 ? "" : fmt::format(", and {} times more", jumps.size() - 1);
  return {{Grade::kWarning, "poses_jump",
           fmt::format("the poses jump by {:.1f} m and {:.0f}° between {} and {} ns (poses {} and "
                       "{} of them){}: the SLAM began anew there, or closed a loop; cut the drive "
                       "there, or give the poses of one map",
                       first.metres, 180.0 / M_PI * first.rad, toNanoseconds(before.time),
                       toNanoseconds(after.time), first.before + 1, first.before + 2, more)}};
}

DataFindings judgePoseAxes(const Poses& poses, const replay::Recording& recording) {
  constexpr double kSound = 0.5, kCommon = 0.6, kMore = 0.3, kAlike = 0.03;
  if (poses.empty() || recording.calibration.cameras.empty()) return {};
  if (!measuresGravity(recording.imu)) return {};
  const auto given = bestScale(poses, recording);
  if (auto finding = degrees(poses, recording, given)) return {*finding};
  if (given && given->common > kSound) return {};
  const double as_given = given ? given->common : 0.0;
  const auto as_camera = bestScale(ofBody(poses, recording), recording);
  if (as_camera && as_camera->common > std::max(kCommon, as_given + kMore)) {
    return {{Grade::kFatal, "poses_of_camera",
             fmt::format("the poses accelerate as those of the camera ({:.0f} % in common with the "
                         "accelerometer; as those of the body {:.0f} %): give --odometry-of "
                         "camera, or T_WB, which is T_WC times the inverse of T_BS",
                         100.0 * as_camera->common, 100.0 * as_given)}};
  }
  const TurnIntegral gyro(recording.imu);
  const auto all = allSignedAxes();
  std::vector<double> common;
  double best = 0.0;
  std::size_t steps = 0;
  for (const double seconds : {0.3, 1.0, 2.0}) {
    const auto pushes = pushesOf(poses, recording, gyro, seconds);
    std::vector<double> of_these;
    for (const SignedAxes& axes : all) of_these.push_back(commonOf(pushes, axes));
    const double most = *std::max_element(of_these.begin(), of_these.end());
    if (most <= best) continue;
    best = most, steps = pushes.size(), common = of_these;
  }
  if (best < kCommon || best < as_given + kMore) return {};
  std::vector<SignedAxes> likely;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (common[i] > best - kAlike) likely.push_back(all[i]);
  }
  return {{Grade::kWarning, "poses_other_position_axes",
           fmt::format("the positions of the poses accelerate along other axes than the "
                       "accelerometer says, turned by their orientations, in {} steps of the drive "
                       "({:.0f} % in common, and {:.0f} % with other axes): positions and "
                       "orientations are not of one world; write {} in place of x, y, z",
                       steps, 100.0 * as_given, 100.0 * best, orderText(likely))}};
}

}  // namespace perdure::tools
