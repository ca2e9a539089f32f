#include "tools/data_check/motion_check.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <future>
#include <opencv2/core.hpp>

#include "common/base/algorithms/median.h"
#include "common/camera/camera_model.h"
#include "common/math/so3.h"
#include "tools/data_check/image_turn.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::tools {
namespace {

using replay::DataFinding;
using replay::Recording;
using Frames = std::vector<const Recording::FrameFile*>;

constexpr std::size_t kLeastTurns = 8;
constexpr double kDegrees = 180.0 / M_PI;

Frames firstCamera(const Recording& recording) {
  Frames frames;
  for (const auto& frame : recording.frames) {
    if (frame.camera == 0 && (frame.load || !frame.path.empty())) frames.push_back(&frame);
  }
  return frames;
}

/// Change of rotation from one image pair to the next, in rad; 0 without samples. A constant
/// rotation contains no information about the time offset.
std::vector<double> liveliness(const Frames& frames, const std::vector<ImuSample>& samples) {
  const TurnIntegral gyro(samples);
  std::vector<double> values(frames.empty() ? 0 : frames.size() - 1, 0.0);
  for (std::size_t i = 0; i + 2 < frames.size(); ++i) {
    const TimePoint from = frames[i]->time, middle = frames[i + 1]->time, to = frames[i + 2]->time;
    if (!gyro.covers(from, to)) continue;
    values[i + 1] = (gyro.between(middle, to) - gyro.between(from, middle)).norm();
  }
  return values;
}

/// Returns up to three runs of consecutive pairs with the largest changes. In a run each image is
/// decoded only once.
using Run = std::pair<std::size_t, std::size_t>;
std::vector<Run> liveliestRuns(const std::vector<double>& values, std::size_t most) {
  constexpr std::size_t kRuns = 3;
  const std::size_t length = std::max<std::size_t>(1, most / kRuns);
  if (values.size() <= most) return {{0, values.size()}};
  std::vector<std::pair<double, std::size_t>> runs;
  for (std::size_t begin = 0; begin + length <= values.size(); begin += length) {
    double sum = 0.0;
    for (std::size_t i = begin; i < begin + length; ++i) sum += values[i];
    runs.emplace_back(-sum, begin);
  }
  std::sort(runs.begin(), runs.end());
  // One run at least is of the other half of the drive, where something may have changed.
  const auto isFirstHalf = [&](const auto& run) { return 2 * run.second < values.size(); };
  const bool first = isFirstHalf(runs.front());
  const auto other = std::find_if(runs.begin(), runs.end(),
                                  [&](const auto& run) { return isFirstHalf(run) != first; });
  if (other >= runs.begin() + kRuns && other != runs.end())
    std::iter_swap(runs.begin() + kRuns - 1, other);
  runs.resize(std::min(runs.size(), kRuns));
  std::vector<Run> chosen;
  for (const auto& [negative, begin] : runs) chosen.emplace_back(begin, begin + length);
  return chosen;
}

/// The calibration of images that are reduced by `factor`.
CameraCalibration reduced(CameraCalibration camera, int factor) {
  const auto n = static_cast<double>(factor);
  camera.width /= static_cast<std::uint32_t>(factor);
  camera.height /= static_cast<std::uint32_t>(factor);
  camera.fx /= n, camera.fy /= n;
  camera.cx = (camera.cx + 0.5) / n - 0.5, camera.cy = (camera.cy + 0.5) / n - 0.5;
  return camera;
}

/// The rotations of the pairs from `run.first` to before `run.second`.
KnownTurns turnsOfRun(const Frames& frames, const CameraCalibration& calibration, const Run& run) {
  constexpr std::uint32_t kColumns = 340;
  const int factor = replay::reductionFor(calibration, kColumns);
  const CameraModel camera(reduced(calibration, factor));
  KnownTurns turns;
  FollowedImage before;
  for (std::size_t i = run.first; i <= run.second; ++i) {
    const auto image = replay::monoImageOf(*frames[i], factor);
    const bool fits = image && replay::isOfCamera(*image, factor, calibration);
    FollowedImage now = fits ? FollowedImage(*image) : FollowedImage();
    if (i > run.first) {
      auto& turn = turns[i - 1];
      const auto flow =
          before.empty() || now.empty() ? std::vector<Flow>() : flowBetween(camera, before, now);
      if (!flow.empty()) turn = {frames[i - 1]->time, frames[i]->time, rotationOf(flow)};
    }
    before = std::move(now);
  }
  return turns;
}

/// The parts of `run` that are not known, each short enough that several are computed in parallel.
std::vector<Run> unknownIn(const Run& run, const KnownTurns& known) {
  constexpr std::size_t kLongest = 20;
  std::vector<Run> parts;
  for (std::size_t i = run.first; i < run.second; ++i) {
    if (known.contains(i)) continue;
    const bool follows = !parts.empty() && parts.back().second == i;
    if (!follows || i - parts.back().first >= kLongest) parts.emplace_back(i, i);
    parts.back().second = i + 1;
  }
  return parts;
}

/// Adds what is not known. Reads image files in parallel, but images inside a recording file one
/// after another.
std::vector<Turn> turnsOfRuns(const Frames& frames, const CameraCalibration& calibration,
                              const std::vector<Run>& chosen, KnownTurns& known) {
  const auto policy = frames.front()->load ? std::launch::deferred : std::launch::async;
  std::vector<std::future<KnownTurns>> parts;
  for (const auto& run : chosen) {
    for (const Run& part : unknownIn(run, known)) {
      parts.push_back(
          std::async(policy, [&, part] { return turnsOfRun(frames, calibration, part); }));
    }
  }
  for (auto& part : parts) known.merge(part.get());
  std::vector<Turn> turns;
  for (const auto& run : chosen) {
    for (std::size_t i = run.first; i < run.second; ++i) {
      if (const auto& turn = known.at(i)) turns.push_back(*turn);
    }
  }
  return turns;
}

/// Rotations of the images (reference) and of the gyroscope, whose times are shifted by `later_s`.
TurnPairs pairsOf(const std::vector<Turn>& turns, const TurnIntegral& gyro, double later_s) {
  const Duration later = durationFromSeconds(later_s);
  std::vector<Eigen::Vector3d> images, said;
  for (const Turn& turn : turns) {
    if (!gyro.covers(turn.from + later, turn.to + later)) continue;
    images.push_back(turn.of_images);
    said.push_back(gyro.between(turn.from + later, turn.to + later));
  }
  return {images, said};
}

constexpr double kEnough_px = 2.0;    ///< least rotation between two images for a judgement
constexpr double kExplained = 0.3;    ///< largest unexplained share of good data
constexpr double kUnexplained = 0.7;  ///< least unexplained share of faulty data

/// Whether the rates are in degrees. They are, if they exceed those of any carried sensor, or are
/// proportional to the image rotation and about 57 times as large. T_BS may be wrong too; if the
/// images clearly rotate, the ratio alone suffices.
bool isInDegrees(const TurnPairs& pairs, double pair_s, const CameraCalibration& camera) {
  constexpr double kClearly_px = 1.0, kCommon = 0.5, kFastest = 4.0;  // px; share; rad/s, mean
  if (pairs.turningOfGiven() > kFastest * pair_s) return true;
  const double ratio = pairs.turningOfGiven() / std::max(1e-9, pairs.turning());
  const Eigen::Matrix3Xd said = camera.T_BC.R().transpose() * pairs.given;
  const double shown =
      (pairs.reference.array() * said.array()).sum() / std::max(1e-18, said.squaredNorm());
  const double left = (pairs.reference - shown * said).squaredNorm();
  const bool of_one_course = left < kCommon * pairs.reference.squaredNorm();
  if (of_one_course) return shown * kDegrees > 0.7 && shown * kDegrees < 1.4;
  return pairs.turning() * camera.fx > kClearly_px && ratio > 0.5 * kDegrees &&
         ratio < 2.0 * kDegrees;
}

/// Returns a finding if the rates, without their mean, are thousands of times those of the images
/// or of any body. Their integrals exceed a turn, so that they cannot be compared.
replay::DataFindings judgeThousandths(const TurnPairs& pairs, double pair_s,
                                      const std::vector<ImuSample>& samples,
                                      const CameraCalibration& camera) {
  constexpr double kLeast = 5e3, kLeast_px = 0.3, kNoBody = 100.0;  // rad/s
  Eigen::Vector3d middle;  // medians, because some samples may be spikes
  for (Eigen::Index i = 0; i < 3; ++i) {
    std::vector<double> values;
    for (const auto& sample : samples) values.push_back(sample.gyro[i]);
    middle[i] = medianOf(std::move(values));
  }
  std::vector<double> deviations;
  for (const auto& sample : samples) deviations.push_back((sample.gyro - middle).norm());
  const double rate = medianOf(std::move(deviations));
  const bool seen = pairs.turning() * camera.fx > kLeast_px;
  if (rate < kNoBody && !(seen && rate * pair_s > kLeast * pairs.turning())) return {};
  return {
      {DataFinding::Grade::kFatal, "gyro_scale",
       fmt::format("the gyroscope's rates vary by {:.3g} (median), far more than the images show: "
                   "they are in thousandths of a degree per second (then multiply its columns "
                   "by 1.74533e-5), or the sensor's counts (by the scale of its data sheet)",
                   rate)}};
}

/// Judges the unit: rates that are far larger or smaller than the image rotation.
replay::DataFindings judgeScale(const TurnPairs& pairs, double pair_s,
                                const CameraCalibration& camera) {
  const double gyro = pairs.turningOfGiven(), images = pairs.turning(), focal = camera.fx;
  const double ratio = gyro / std::max(1e-9, images);
  if (ratio > 20.0 && gyro * focal > 3.0) {
    if (isInDegrees(pairs, pair_s, camera)) {
      return {{DataFinding::Grade::kFatal, "gyro_in_degrees",
               fmt::format("the gyroscope's turning is {:.0f} times what the images show: it is in "
                           "degrees per second; multiply its columns by 0.0174533",
                           ratio)}};
    }
    return {{DataFinding::Grade::kFatal, "images_still",
             fmt::format("the images of {} hardly turn ({:.2g} px from one to the next) while the "
                         "gyroscope says {:.2g} px: images that stand still or come again, another "
                         "drive's, or rates in another unit",
                         camera.name, images * focal, gyro * focal)}};
  }
  if (gyro < 1e-12 && images * focal > 3.0) {
    return {{DataFinding::Grade::kFatal, "gyro_constant",
             "the gyroscope says the same all the time while the images turn: it is off, or its "
             "columns were not recorded; record w_x, w_y, w_z, which vio needs"}};
  }
  if (ratio < 1.0 / 20.0 && images * focal > 3.0) {
    return {
        {DataFinding::Grade::kFatal, "gyro_too_small",
         fmt::format("the images turn {:.0f} times as much as the gyroscope says: its unit is too "
                     "small (where degrees were converted twice, multiply its columns by 57.2958), "
                     "or the images "
                     "are of another drive",
                     1.0 / std::max(1e-4, ratio))}};
  }
  return {};
}

/// Returns the time offset in s that explains the rotation, and explains it `clearly` times as well
/// as `camera.time_offset_s` does. Returns nothing if there is no such offset.
std::optional<double> betterOffset(const std::vector<Turn>& turns, const TurnIntegral& gyro,
                                   const CameraCalibration& camera, double most_s, double clearly) {
  const Eigen::Matrix3d R_CB = camera.T_BC.R().transpose();
  const auto leftAt = [&](double later) {
    const TurnPairs pairs = pairsOf(turns, gyro, later);
    return 2 * pairs.count() < turns.size() ? 1.0 : pairs.unexplained(R_CB);
  };
  double best = std::min(kExplained, leftAt(camera.time_offset_s) / clearly);
  std::optional<double> offset;
  bool inside = false;  // whether the optimum is inside the search range
  const int steps = static_cast<int>(std::lround(100.0 * most_s));
  for (int step = -steps; step <= steps; ++step) {
    const double later = camera.time_offset_s + 0.01 * step;
    const double left = leftAt(later);
    if (left >= best) continue;
    best = left;
    offset = later;
    inside = std::abs(step) < steps;
  }
  return inside ? offset : std::nullopt;
}

/// The pairs whose rotation is exactly known: corners are lost in long ones.
std::vector<Turn> shortTurns(std::vector<Turn> turns) {
  constexpr double kLongest_s = 0.15, kLargest = 0.15;  // s, rad
  std::erase_if(turns, [](const Turn& turn) {
    return toSeconds(turn.to - turn.from) > kLongest_s || turn.of_images.norm() > kLargest;
  });
  return turns;
}

/// Judges rates that are some percent too large or too small but agree with the images otherwise.
replay::DataFindings judgeFactor(const TurnPairs& pairs, const CameraCalibration& camera) {
  if (pairs.count() < kLeastTurns) return {};
  constexpr double kLeast = 0.04, kSurely = 3.0, kAgreed = 0.05;
  const Eigen::Matrix3Xd said = camera.T_BC.R().transpose() * pairs.given;
  const double all = std::max(1e-18, said.squaredNorm());
  const double shown = (pairs.reference.array() * said.array()).sum() / all;
  const double left = (pairs.reference - shown * said).squaredNorm();
  const double sigma = std::sqrt(left / (static_cast<double>(3 * pairs.count()) * all));
  if (left > kAgreed * pairs.reference.squaredNorm()) return {};
  if (std::abs(shown - 1.0) < kLeast + kSurely * sigma) return {};
  return {{DataFinding::Grade::kWarning, "gyro_factor",
           fmt::format("the gyroscope says {:.2f} times the turning that {} shows, in {} pairs of "
                       "images: see the scale of its columns, or the focal length",
                       1.0 / shown, camera.name, pairs.count())}};
}

/// Limits of the judgement of the images' stamps.
constexpr double kLongestOffset_s = 1.0, kOffsetClearly = 3.0;

replay::DataFindings judgePlace(const std::vector<Turn>& turns, const TurnIntegral& gyro,
                                const TurnPairs& pairs, const CameraCalibration& camera) {
  const Eigen::Matrix3d R_BC = camera.T_BC.R(), R_CB = R_BC.transpose();
  const double given = pairs.unexplained(R_CB);
  const double inverse = pairs.unexplained(R_BC);
  // T_BS is not inverted if another rotation, such as a column permutation, explains clearly more.
  const double least = pairs.unexplained(pairs.bestRotation());
  constexpr double kNoise = 0.05;
  if (given > kUnexplained && inverse < std::min(kExplained, 2.0 * least + kNoise)) {
    return {{DataFinding::Grade::kFatal, "T_BS_inverted",
             fmt::format(
                 "T_BS of {} is the wrong way round: its inverse explains {:.0f} % of the "
                 "images' turning, it itself {:.0f} %; write the camera in the IMU's frame (the "
                 "inverse of Kalibr's T_cam_imu)",
                 camera.name, 100.0 * (1.0 - inverse), 100.0 * std::max(0.0, 1.0 - given))}};
  }
  // A smaller unexplained share means a small time offset, which vio estimates.
  constexpr double kShown = 0.02;
  if (given < kShown) return {};
  if (const auto later = betterOffset(turns, gyro, camera, kLongestOffset_s, kOffsetClearly)) {
    return {
        {DataFinding::Grade::kCause, "time_offset",
         fmt::format("the stamps of {} and of the IMU do not fit: set time_offset_s to {:.2f}, and "
                     "see which clock is wrong",
                     camera.name, *later)}};
  }
  constexpr double kTurned = 0.1;
  const Eigen::Matrix3d R_best = pairs.bestRotation();
  if (given > kTurned && pairs.unexplained(R_best) < std::min(kExplained, given / 2.0)) {
    const double angle = Eigen::AngleAxisd(R_best * R_BC).angle();
    return {{DataFinding::Grade::kWarning, "T_BS_turned",
             fmt::format("the images of {} turn as if the camera were turned by about {:.0f}° from "
                         "where T_BS has it: see the axes of T_BS and of the IMU, or calibrate",
                         camera.name, kDegrees * angle)}};
  }
  return {};
}

}  // namespace

std::vector<Turn> turnsOfImages(const Recording& recording, const std::vector<ImuSample>& samples,
                                std::size_t most, KnownTurns* known) {
  KnownTurns none;
  const Frames frames = firstCamera(recording);
  if (frames.size() < 2 || samples.size() < 2) return {};
  return turnsOfRuns(frames, recording.calibration.cameras.front(),
                     liveliestRuns(liveliness(frames, samples), most), known ? *known : none);
}

std::vector<Turn> turnsAlong(const Recording& recording, KnownTurns* known) {
  constexpr std::size_t kRuns = 8, kPairs = 15;
  KnownTurns none;
  const Frames frames = firstCamera(recording);
  if (frames.size() < 2) return {};
  const std::size_t pairs = frames.size() - 1, length = std::min(kPairs, pairs),
                    runs = std::min(kRuns, pairs / length);
  std::vector<Run> chosen;
  for (std::size_t i = 0; i < runs; ++i) {
    const std::size_t first = i * (pairs - length) / std::max<std::size_t>(1, runs - 1);
    chosen.emplace_back(first, first + length);
  }
  return turnsOfRuns(frames, recording.calibration.cameras.front(), chosen, known ? *known : none);
}

bool disagree(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
              const CameraCalibration& camera) {
  constexpr double kMuch = 0.1;
  const TurnPairs pairs = pairsOf(turns, TurnIntegral(samples), camera.time_offset_s);
  if (2 * pairs.count() < turns.size()) return true;
  if (std::max(pairs.turning(), pairs.turningOfGiven()) * camera.fx < kEnough_px) return false;
  return pairs.unexplained(camera.T_BC.R().transpose()) > kMuch;
}

replay::DataFindings judgeTurns(const std::vector<Turn>& turns,
                                const std::vector<ImuSample>& samples,
                                const CameraCalibration& camera) {
  const TurnIntegral gyro(samples);
  const TurnPairs pairs = pairsOf(turns, gyro, camera.time_offset_s);
  if (pairs.count() < kLeastTurns) return {};
  const double pair_s = toSeconds(turns.front().to - turns.front().from);
  auto findings = judgeThousandths(pairs, pair_s, samples, camera);
  if (findings.empty()) findings = judgeScale(pairs, pair_s, camera);
  if (!findings.empty()) return findings;
  if (std::min(pairs.turningOfGiven(), pairs.turning()) * camera.fx < kEnough_px) return {};
  auto place = judgePlace(turns, gyro, pairs, camera);
  if (!place.empty()) return place;
  return judgeFactor(pairsOf(shortTurns(turns), gyro, camera.time_offset_s), camera);
}

std::optional<double> offsetOfTurns(const std::vector<Turn>& turns,
                                    const std::vector<ImuSample>& samples,
                                    const CameraCalibration& camera) {
  return betterOffset(turns, TurnIntegral(samples), camera, kLongestOffset_s, kOffsetClearly);
}

std::vector<ImuSample> turnsOfPoses(const std::vector<replay::StampedPose>& poses) {
  std::vector<ImuSample> samples;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Duration step = poses[i].time - poses[i - 1].time;
    if (step <= Duration(0)) continue;
    ImuSample sample;
    sample.time = poses[i - 1].time + step / 2;
    sample.gyro = logSo3(Eigen::Quaterniond(poses[i - 1].T_WB.q.conjugate() * poses[i].T_WB.q)) /
                  toSeconds(step);
    samples.push_back(sample);
  }
  return samples;
}

replay::DataFindings judgePoseTurns(const std::vector<Turn>& turns,
                                    const std::vector<ImuSample>& samples,
                                    const CameraCalibration& camera) {
  constexpr double kLongest_s = 2.0, kLeast_s = 0.1, kClearly = 3.0;
  CameraCalibration at_images = camera;  // poses have image stamps
  at_images.time_offset_s = 0.0;
  const TurnIntegral poses(samples);
  const TurnPairs pairs = pairsOf(turns, poses, 0.0);
  if (pairs.count() < kLeastTurns) return {};
  if (pairs.turning() * camera.fx < kEnough_px) return {};
  const auto later = betterOffset(turns, poses, at_images, kLongest_s, kClearly);
  if (!later || std::abs(*later) < kLeast_s) return {};
  return {
      {DataFinding::Grade::kWarning, "poses_time_offset",
       fmt::format("the images of {} turn {:.2f} s {} the poses that are given: {} {:.2f} s {} the "
                   "times of the poses, or see which frame each of them is of",
                   camera.name, std::abs(*later), *later > 0 ? "before" : "after",
                   *later > 0 ? "subtract" : "add", std::abs(*later), *later > 0 ? "from" : "to")}};
}

}  // namespace perdure::tools
