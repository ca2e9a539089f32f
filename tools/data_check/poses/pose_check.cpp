#include "tools/data_check/poses/pose_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "common/math/so3.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::tools {
namespace {

using replay::DataFinding;
using replay::DataFindings;
using replay::StampedPose;
using Grade = DataFinding::Grade;
using Quaternion = Eigen::Quaterniond;

constexpr double kInDegrees = 180.0 / M_PI;

/// A convention in which poses may have been written.
struct Reading {
  const char *code, *what, *fix;
  bool w_first, inverted, of_camera;

  Quaternion body(const Quaternion& written, const Quaternion& q_BC) const {
    Quaternion q = written;
    if (w_first) q = Quaternion(written.x(), written.y(), written.z(), written.w());
    if (inverted) q = q.conjugate();
    return of_camera ? q * q_BC.conjugate() : q;
  }
};

constexpr char kInvert[] = "give their inverse, the body in the world";
constexpr char kConjugate[] = "conjugate the quaternions (write -qx, -qy, -qz), the positions stay";
constexpr char kEither[] =
    "give their inverse, the body in the world, where the positions are those of the world in the "
    "body; else conjugate the quaternions alone (write -qx, -qy, -qz)";
constexpr char kOrder[] = "write the quaternions as qx qy qz qw";
constexpr char kAxes[] =
    "give --odometry-of camera, or T_WB, which is T_WC times the inverse of T_BS";
constexpr char kBoth[] = "give T_WB, in the order t x y z qx qy qz qw";
constexpr std::array kReadings{
    Reading{"", "as they are", "", false, false, false},
    Reading{"poses_inverted", "inverted, the world in the body", kInvert, false, true, false},
    Reading{"poses_w_first", "with the quaternion's w first", kOrder, true, false, false},
    Reading{"poses_of_camera", "in the camera's axes", kAxes, false, false, true},
    Reading{"poses_inverted", "inverted, the world in the camera", kBoth, false, true, true},
    Reading{"poses_w_first", "of the camera, with the quaternion's w first", kBoth, true, false,
            true},
    Reading{"poses_w_first", "inverted, with the quaternion's w first", kBoth, true, true, false},
    Reading{"poses_w_first", "inverted, of the camera, and with the quaternion's w first", kBoth,
            true, true, true}};

/// Two poses, and the rotation between them as another sensor measured it, in B.
struct Step {
  Quaternion from, to;
  Eigen::Vector3d reference;
};

TurnPairs pairsOf(const std::vector<Step>& steps, const Reading& reading, const Quaternion& q_BC) {
  std::vector<Eigen::Vector3d> reference, given;
  for (const Step& step : steps) {
    const Quaternion from = reading.body(step.from, q_BC), to = reading.body(step.to, q_BC);
    reference.push_back(step.reference);
    given.push_back(logSo3(Quaternion(from.conjugate() * to)));
  }
  return {reference, given};
}

/// Pairs of poses `seconds` apart; the times of the poses plus `later_s` are those of the
/// gyroscope.
std::vector<Step> stepsOf(const std::vector<StampedPose>& poses, const TurnIntegral& gyro,
                          double seconds, double later_s) {
  const Duration length = durationFromSeconds(seconds), later = durationFromSeconds(later_s);
  std::vector<Step> steps;
  TimePoint next = TimePoint::min();
  for (std::size_t i = 0, j = 0; i < poses.size(); ++i) {
    if (poses[i].time < next) continue;
    while (j < poses.size() && poses[j].time < poses[i].time + length - length / 20) ++j;
    if (j == poses.size()) break;
    if (poses[j].time > poses[i].time + 2 * length) continue;
    const TimePoint from = poses[i].time + later, to = poses[j].time + later;
    if (!gyro.covers(from, to)) continue;
    steps.push_back({poses[i].T_WB.q, poses[j].T_WB.q, gyro.between(from, to)});
    next = poses[i].time + length / 2;
  }
  return steps;
}

struct Limits {
  std::size_t fewest;   ///< least number of pairs
  double least_rad;     ///< least rotation in a pair
  double shown;         ///< least disagreement at which axes may differ
  double contradicted;  ///< least disagreement at which a reading is wrong
  double explained;     ///< largest disagreement of a correct reading
};

struct Sensor {
  const char *name, *else_see;
};
constexpr Sensor kGyro{"the gyroscope", "the axes of the IMU"}, kImages{"the images", "T_BS"};

std::string namesOf(const std::vector<const Reading*>& readings) {
  std::string names;
  for (const Reading* reading : readings) {
    names += (names.empty() ? "" : ", or ") + std::string(reading->what);
  }
  return names;
}

struct Wrong {
  std::vector<const Reading*> likely;  ///< sorted by likelihood
  DataFinding finding;
};

/// Returns the conventions under which the poses agree with the sensor, unless they agree as
/// written.
std::optional<Wrong> wrongReading(const std::vector<Step>& steps, const Quaternion& q_BC,
                                  const Limits& limits, const Sensor& sensor) {
  if (steps.size() < limits.fewest) return std::nullopt;
  const TurnPairs given = pairsOf(steps, kReadings[0], q_BC);
  const double disagreement = given.disagreement();
  if (given.turning() < limits.least_rad || disagreement < limits.contradicted) return std::nullopt;
  const bool turned = Eigen::AngleAxisd(q_BC).angle() > 0.2;
  double best = limits.explained;
  for (const Reading& reading : kReadings) {
    if (reading.of_camera && !turned) continue;
    best = std::min(best, pairsOf(steps, reading, q_BC).disagreement());
  }
  if (best >= limits.explained) return std::nullopt;
  // If the body rotates about one axis only, exchanged axes may resemble an inverse.
  constexpr double kFits = 0.005, kClearly = 3.0;
  if (best > kFits && given.disagreementBy(given.bestRotation()) < best / kClearly) {
    return std::nullopt;
  }
  std::vector<const Reading*> likely;
  for (const Reading& reading : kReadings) {
    if (reading.of_camera && !turned) continue;
    const double left = pairsOf(steps, reading, q_BC).disagreement();
    if (left < limits.explained && left < 2.0 * best + 0.01) likely.push_back(&reading);
  }
  return Wrong{
      likely,
      {Grade::kFatal, likely.front()->code,
       fmt::format(
           "the poses turn otherwise than {} in {} steps of the drive (they agree to {:.0f} "
           "%); they agree to {:.0f} % where they are read as ",
           sensor.name, steps.size(), 100.0 * std::max(0.0, 1.0 - disagreement),
           100.0 * (1.0 - best))}};
}

/// The finding with its fix. Positions decide between an inverted pose and a conjugated quaternion,
/// because their rotations are equal.
DataFinding repaired(Wrong wrong, const std::vector<StampedPose>& poses,
                     const replay::Recording& recording) {
  const Reading& reading = *wrong.likely.front();
  std::string names = namesOf(wrong.likely), fix = reading.fix;
  if (reading.inverted && !reading.w_first) {
    const Inversion how = howInverted(poses, recording, reading.of_camera);
    if (how == Inversion::kUnsure) fix = kEither;
    if (how == Inversion::kQuaternion) {
      wrong.finding.code = "poses_conjugated";
      names = "conjugated, while their positions are right";
      fix = kConjugate;
    }
    if (how != Inversion::kPose && reading.of_camera) fix += fmt::format("; and {}", kAxes);
  }
  wrong.finding.text += names + ": " + fix;
  return wrong.finding;
}

/// "their x is the body's -y, …" if R maps axes to axes; otherwise its angle.
std::string axesText(const Eigen::Matrix3d& R) {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  std::string text;
  for (Eigen::Index i = 0; i < 3; ++i) {
    Eigen::Index row = 0;
    R.col(i).cwiseAbs().maxCoeff(&row);
    axes(row, i) = R(row, i) < 0 ? -1.0 : 1.0;
    text += fmt::format("{}{} is {}{}", i == 0 ? "" : ", ", "xyz"[i], axes(row, i) < 0 ? "-" : "",
                        "xyz"[row]);
  }
  const bool whole = (axes.transpose() * axes).isIdentity();
  const double off = whole ? Eigen::AngleAxisd(R * axes.transpose()).angle() : M_PI;
  if (off < 0.2) return "their axes, in those of the body: " + text;
  return fmt::format("their axes are turned by about {:.0f}° from the body's",
                     kInDegrees * Eigen::AngleAxisd(R).angle());
}

std::optional<DataFinding> otherAxes(const std::vector<Step>& steps, const Quaternion& q_BC,
                                     const Limits& limits, const Sensor& sensor) {
  if (steps.size() < limits.fewest) return std::nullopt;
  const TurnPairs given = pairsOf(steps, kReadings[0], q_BC);
  const double disagreement = given.disagreement();
  const Eigen::Matrix3d R = given.bestRotation();
  const double left = given.disagreementBy(R);
  constexpr double kClearly = 3.0;
  if (given.turning() < limits.least_rad || disagreement < limits.shown) return std::nullopt;
  if (left > std::min(limits.explained, disagreement / kClearly)) return std::nullopt;
  return DataFinding{
      Grade::kWarning, "poses_other_axes",
      fmt::format(
          "the poses turn about other axes than {} in {} steps of the drive (they agree "
          "to {:.0f} %, and to {:.0f} % once turned); {}: give poses of the body, or see {}",
          sensor.name, steps.size(), 100.0 * std::max(0.0, 1.0 - disagreement),
          100.0 * (1.0 - left), axesText(R), sensor.else_see)};
}

constexpr double kMostLater_s = 2.0;  ///< largest time offset that is tried

/// Returns the time in s to add to the poses' times, if it explains their rotations clearly better.
std::optional<double> betterTime(const std::vector<StampedPose>& poses, const TurnIntegral& gyro,
                                 const CameraCalibration& camera, const Limits& limits) {
  constexpr double kStep_s = 0.3, kEach_s = 0.02, kShown = 0.2, kClearly = 3.0;
  const auto leftAt = [&](double later) {
    const auto steps = stepsOf(poses, gyro, kStep_s, camera.time_offset_s + later);
    if (steps.size() < limits.fewest) return 1.0;
    const TurnPairs pairs = pairsOf(steps, kReadings[0], camera.T_BC.q);
    return pairs.turning() < limits.least_rad ? 1.0 : pairs.disagreement();
  };
  const double now = leftAt(0.0);
  if (now < kShown) return std::nullopt;
  double best = std::min(limits.explained, now / kClearly);
  std::optional<double> offset;
  const int most = static_cast<int>(std::lround(kMostLater_s / kEach_s));
  for (int i = -most; i <= most; ++i) {
    const double left = leftAt(kEach_s * i);
    if (left < best) best = left, offset = kEach_s * i;
  }
  return offset;
}

/// Time offsets of the poses in their first and in their last third. They differ if the poses'
/// clock is too fast or too slow.
struct GrowingOffset {
  double first_s, last_s, per_second;
};

std::optional<GrowingOffset> growingOffset(const std::vector<StampedPose>& poses,
                                           const TurnIntegral& gyro,
                                           const CameraCalibration& camera, const Limits& limits) {
  constexpr double kStep_s = 0.3, kEach_s = 0.02, kGrows_s = 0.1, kClearly = 3.0, kShown = 0.02;
  if (poses.size() < 6) return std::nullopt;
  const auto leftAt = [&](const std::vector<StampedPose>& some, double later) {
    const auto steps = stepsOf(some, gyro, kStep_s, camera.time_offset_s + later);
    if (steps.size() < limits.fewest) return 1.0;
    const TurnPairs pairs = pairsOf(steps, kReadings[0], camera.T_BC.q);
    return pairs.turning() < limits.least_rad ? 1.0 : pairs.disagreement();
  };
  if (leftAt(poses, 0.0) < kShown) return std::nullopt;
  const auto third = static_cast<std::ptrdiff_t>(poses.size() / 3);
  const std::array thirds{std::vector<StampedPose>(poses.begin(), poses.begin() + third),
                          std::vector<StampedPose>(poses.end() - third, poses.end())};
  std::array<double, 2> offset{}, left{};
  const int most = static_cast<int>(std::lround(kMostLater_s / kEach_s));
  for (std::size_t k = 0; k < thirds.size(); ++k) {
    left[k] = 1.0;
    for (int i = -most; i <= most; ++i) {
      const double now = leftAt(thirds[k], kEach_s * i);
      if (now < left[k]) left[k] = now, offset[k] = kEach_s * i;
    }
  }
  if (std::max(left[0], left[1]) > limits.explained) return std::nullopt;
  if (std::abs(offset[1] - offset[0]) < kGrows_s) return std::nullopt;
  if (leftAt(thirds[0], offset[1]) < kClearly * left[0]) return std::nullopt;
  if (leftAt(thirds[1], offset[0]) < kClearly * left[1]) return std::nullopt;
  const auto middleOf = [](const std::vector<StampedPose>& some) {
    return some[some.size() / 2].time;
  };
  const double apart = toSeconds(middleOf(thirds[1]) - middleOf(thirds[0]));
  return GrowingOffset{offset[0], offset[1], (offset[1] - offset[0]) / apart};
}

/// Reports poses of another drive: no change of axes explains their rotations.
std::optional<DataFinding> nothingInCommon(const std::vector<Step>& steps, const Quaternion& q_BC,
                                           const Limits& limits) {
  constexpr double kMuch_rad = 0.1, kAlien = 0.9, kStillAlien = 0.7, kAlike = 3.0;
  if (steps.size() < 2 * limits.fewest) return std::nullopt;
  const TurnPairs given = pairsOf(steps, kReadings[0], q_BC);
  const double ratio = given.given.norm() / std::max(1e-9, given.reference.norm());
  if (given.turning() < kMuch_rad || ratio > kAlike || ratio < 1.0 / kAlike) return std::nullopt;
  if (given.disagreement() < kAlien) return std::nullopt;
  if (given.disagreementBy(given.bestRotation()) < kStillAlien) return std::nullopt;
  return DataFinding{
      Grade::kWarning, "poses_contradict_gyro",
      fmt::format("the poses turn otherwise than the gyroscope in {} steps of the drive, and no "
                  "other axes explain it: see whether they are of this drive and on its clock",
                  steps.size())};
}

}  // namespace

DataFinding posesAtOtherTimes(const std::string& what, double later_s, bool may_be_more) {
  const bool early = later_s < 0.0;
  const double seconds = std::abs(later_s);
  return {Grade::kWarning, "poses_time_offset",
          fmt::format("{} {}{:.2f} s {} the poses that are given: {} {:.2f} s {} the times of the "
                      "poses{}, or see which frame each of them is of",
                      what, may_be_more ? "at least " : "", seconds, early ? "before" : "after",
                      early ? "subtract" : "add", seconds, early ? "from" : "to",
                      may_be_more ? " and check again" : "")};
}

std::vector<StampedPose> timedPoses(const replay::PoseFile& file,
                                    const replay::Recording& recording) {
  if (file.format() == replay::PoseFormat::kTum) return file.poses();
  std::vector<StampedPose> poses;
  for (const auto& frame : recording.frames) {
    if (frame.camera != 0 || frame.index >= file.poses().size()) continue;
    if (!poses.empty() && frame.time <= poses.back().time) continue;
    poses.push_back({frame.time, file.poses()[frame.index].T_WB});
  }
  return poses;
}

DataFindings judgePosesByGyro(const std::vector<StampedPose>& poses,
                              const replay::Recording& recording) {
  if (recording.imu.size() < 2 || recording.calibration.cameras.empty()) return {};
  // Short steps suit a shaking body; long steps suit rough poses and slow rotation.
  constexpr std::array kSteps_s{0.3, 1.0};
  constexpr Limits kLimits{
      .fewest = 8, .least_rad = 0.02, .shown = 0.1, .contradicted = 0.5, .explained = 0.15};
  const CameraCalibration& camera = recording.calibration.cameras.front();
  const Quaternion q_BC = camera.T_BC.q;
  const TurnIntegral gyro(recording.imu);
  std::vector<std::vector<Step>> all;
  for (const double seconds : kSteps_s) {
    all.push_back(stepsOf(poses, gyro, seconds, camera.time_offset_s));
  }
  std::vector<Eigen::Vector3d> gyro_turns;
  for (const Step& step : all.back()) gyro_turns.push_back(step.reference);
  if (auto findings = judgePoseTurning(poses, gyro_turns); !findings.empty()) return findings;
  for (const auto& steps : all) {
    if (auto wrong = wrongReading(steps, q_BC, kLimits, kGyro)) {
      return {repaired(std::move(*wrong), poses, recording)};
    }
  }
  if (const auto grows = growingOffset(poses, gyro, camera, kLimits)) {
    return {{Grade::kWarning, "poses_clock_rate",
             fmt::format("the gyroscope turns {:+.2f} s after the poses in their first third and "
                         "{:+.2f} s in their last: the clock of the poses is about {:.1f} % too "
                         "{}; see which frame each of them is of, and give its stamp",
                         grows->first_s, grows->last_s, 100.0 * std::abs(grows->per_second),
                         grows->per_second < 0 ? "fast" : "slow")}};
  }
  if (const auto later = betterTime(poses, gyro, camera, kLimits)) {
    if (std::abs(*later) < 0.1) return {};
    return {posesAtOtherTimes("the gyroscope turns", *later, std::abs(*later) >= kMostLater_s)};
  }
  for (const auto& steps : all) {
    if (auto finding = otherAxes(steps, q_BC, kLimits, kGyro)) return {*finding};
  }
  if (auto finding = nothingInCommon(all.back(), q_BC, kLimits)) return {*finding};
  return {};
}

DataFindings judgePosesByImages(const std::vector<StampedPose>& poses,
                                const std::vector<Turn>& turns,
                                const replay::Recording& recording) {
  const CameraCalibration& camera = recording.calibration.cameras.front();
  constexpr double kEnough_px = 2.0;
  // The limits are wide, because the camera's translation disturbs its measured rotation.
  const Limits limits{.fewest = 12,
                      .least_rad = kEnough_px / camera.fx,
                      .shown = 0.6,
                      .contradicted = 0.6,
                      .explained = 0.3};
  const replay::PoseFile file(replay::PoseFormat::kTum, poses);
  std::vector<Step> steps;
  for (const Turn& turn : turns) {
    const auto from = file.at(0, turn.from), to = file.at(0, turn.to);
    if (from && to) steps.push_back({from->q, to->q, camera.T_BC.q * turn.of_images});
  }
  const Quaternion q_BC = camera.T_BC.q;
  if (auto wrong = wrongReading(steps, q_BC, limits, kImages)) {
    return {repaired(std::move(*wrong), poses, recording)};
  }
  if (auto finding = otherAxes(steps, q_BC, limits, kImages)) return {*finding};
  return {};
}

}  // namespace perdure::tools
