#include "tools/data_check/motion_check.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "common/camera/camera_model.h"
#include "common/math/so3.h"
#include "tools/data_check/image_turn.h"

namespace perdure::tools {
namespace {

using replay::DataFinding;
using replay::Recording;
using Frames = std::vector<const Recording::FrameFile*>;

constexpr std::size_t kLeastTurns = 8;
constexpr double kDegrees = 180.0 / M_PI;

/// The integral of the rates of turn: what it gains is the way of a short turn.
class GyroIntegral {
 public:
  explicit GyroIntegral(const std::vector<ImuSample>& samples) : samples_(samples) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (i > 0) {
        const double dt = toSeconds(samples[i].time - samples[i - 1].time);
        sum += 0.5 * dt * (samples[i].gyro + samples[i - 1].gyro);
      }
      sums_.push_back(sum);
    }
  }
  bool covers(TimePoint from, TimePoint to) const {
    return samples_.size() > 1 && samples_.front().time <= from && to <= samples_.back().time;
  }
  /// Both covered.
  Eigen::Vector3d between(TimePoint from, TimePoint to) const { return at(to) - at(from); }

 private:
  Eigen::Vector3d at(TimePoint time) const {
    const auto next =
        std::upper_bound(samples_.begin(), samples_.end(), time,
                         [](TimePoint t, const ImuSample& sample) { return t < sample.time; });
    if (next == samples_.end()) return sums_.back();
    if (next == samples_.begin()) return sums_.front();
    const auto i = static_cast<std::size_t>(next - samples_.begin());
    const double share =
        toSeconds(time - samples_[i - 1].time) / toSeconds(samples_[i].time - samples_[i - 1].time);
    return sums_[i - 1] + share * (sums_[i] - sums_[i - 1]);
  }

  const std::vector<ImuSample>& samples_;
  std::vector<Eigen::Vector3d> sums_;
};

Frames firstCamera(const Recording& recording) {
  Frames frames;
  for (const auto& frame : recording.frames) {
    if (frame.camera == 0 && (frame.load || !frame.path.empty())) frames.push_back(&frame);
  }
  return frames;
}

/// By how much each pair's turn differs from the one before; 0 where there are no samples. A turn
/// that lasts tells nothing of the time.
std::vector<double> liveliness(const Frames& frames, const std::vector<ImuSample>& samples) {
  const GyroIntegral gyro(samples);
  std::vector<double> values(frames.empty() ? 0 : frames.size() - 1, 0.0);
  for (std::size_t i = 0; i + 2 < frames.size(); ++i) {
    const TimePoint from = frames[i]->time, middle = frames[i + 1]->time, to = frames[i + 2]->time;
    if (!gyro.covers(from, to)) continue;
    values[i + 1] = (gyro.between(middle, to) - gyro.between(from, middle)).norm();
  }
  return values;
}

/// Runs of pairs that follow each other, so that each image is decoded once: the liveliest ones.
std::vector<std::pair<std::size_t, std::size_t>> liveliestRuns(const std::vector<double>& values,
                                                               std::size_t most) {
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
  runs.resize(std::min(runs.size(), kRuns));
  std::vector<std::pair<std::size_t, std::size_t>> chosen;
  for (const auto& [negative, begin] : runs) chosen.emplace_back(begin, begin + length);
  return chosen;
}

/// What gyroscope and images say of the same pairs, without their means, in columns.
struct Pairs {
  Eigen::Matrix3Xd gyro, images;
};

Pairs pairsOf(const std::vector<Turn>& turns, const GyroIntegral& gyro, Duration later) {
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> both;
  for (const Turn& turn : turns) {
    if (!gyro.covers(turn.from + later, turn.to + later)) continue;
    both.emplace_back(gyro.between(turn.from + later, turn.to + later), turn.of_images);
  }
  Pairs pairs{Eigen::Matrix3Xd(3, both.size()), Eigen::Matrix3Xd(3, both.size())};
  for (std::size_t i = 0; i < both.size(); ++i) {
    pairs.gyro.col(static_cast<Eigen::Index>(i)) = both[i].first;
    pairs.images.col(static_cast<Eigen::Index>(i)) = both[i].second;
  }
  if (both.empty()) return pairs;
  pairs.gyro.colwise() -= pairs.gyro.rowwise().mean().eval();
  pairs.images.colwise() -= pairs.images.rowwise().mean().eval();
  return pairs;
}

/// Share of the images' turning that R_CB leaves unexplained: 0 where all is explained.
double unexplained(const Pairs& pairs, const Eigen::Matrix3d& R_CB) {
  return (pairs.images - R_CB * pairs.gyro).squaredNorm() /
         std::max(1e-18, pairs.images.squaredNorm());
}

/// The rotation that explains best (Kabsch).
Eigen::Matrix3d bestRotation(const Pairs& pairs) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(pairs.images * pairs.gyro.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d S = Eigen::Matrix3d::Identity();
  S(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return svd.matrixU() * S * svd.matrixV().transpose();
}

double rms(const Eigen::Matrix3Xd& turns) {
  return std::sqrt(turns.squaredNorm() / std::max<double>(1.0, static_cast<double>(turns.cols())));
}

constexpr double kEnough_px = 2.0;    ///< of turning between two images, to tell
constexpr double kExplained = 0.3;    ///< of the turning is unexplained at most where all is well
constexpr double kUnexplained = 0.7;  ///< and at least where it is not

/// Of a unit: rates that are far larger or smaller than what the images show.
replay::DataFindings judgeScale(double gyro, double images, double focal) {
  const double ratio = gyro / std::max(1e-9, images);
  if (ratio > 20.0 && gyro * focal > 3.0) {
    return {{DataFinding::Grade::kFatal, "gyro_in_degrees",
             fmt::format(
                 "the gyroscope's turning is {:.0f} times what the images show: it is in degrees "
                 "per second (or the images stand still); multiply its columns by 0.0174533",
                 std::min(ratio, 9999.0))}};
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

/// The time that must be added to the images' stamps, where it explains the turning, and `clearly`
/// times as well as `camera.time_offset_s` does.
std::optional<double> betterOffset(const std::vector<Turn>& turns, const GyroIntegral& gyro,
                                   const CameraCalibration& camera, double most_s, double clearly) {
  const Eigen::Matrix3d R_CB = camera.T_BC.R().transpose();
  const auto leftAt = [&](double later) {
    const Pairs pairs = pairsOf(turns, gyro, durationFromSeconds(later));
    const bool few = 2 * pairs.images.cols() < static_cast<Eigen::Index>(turns.size());
    return few ? 1.0 : unexplained(pairs, R_CB);
  };
  double best = std::min(kExplained, leftAt(camera.time_offset_s) / clearly);
  std::optional<double> offset;
  bool inside = false;  // at the edge of the search the best may lie beyond
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

replay::DataFindings judgePlace(const std::vector<Turn>& turns, const GyroIntegral& gyro,
                                const Pairs& pairs, const CameraCalibration& camera) {
  const Eigen::Matrix3d R_BC = camera.T_BC.R(), R_CB = R_BC.transpose();
  const double given = unexplained(pairs, R_CB);
  const double inverse = unexplained(pairs, R_BC);
  // Where another rotation explains clearly more, as columns in another order do, it is no inverse.
  const double least = unexplained(pairs, bestRotation(pairs));
  constexpr double kNoise = 0.05;
  if (given > kUnexplained && inverse < std::min(kExplained, 2.0 * least + kNoise)) {
    return {{DataFinding::Grade::kFatal, "T_BS_inverted",
             fmt::format(
                 "T_BS of {} is the wrong way round: its inverse explains {:.0f} % of the "
                 "images' turning, it itself {:.0f} %; write the camera in the IMU's frame (the "
                 "inverse of Kalibr's T_cam_imu)",
                 camera.name, 100.0 * (1.0 - inverse), 100.0 * std::max(0.0, 1.0 - given))}};
  }
  // What leaves less unexplained is short, and vio estimates it.
  constexpr double kShown = 0.02, kLongest_s = 1.0, kClearly = 3.0;
  if (given < kShown) return {};
  if (const auto later = betterOffset(turns, gyro, camera, kLongest_s, kClearly)) {
    return {
        {DataFinding::Grade::kWarning, "time_offset",
         fmt::format("the stamps of {} and of the IMU do not fit: set time_offset_s to {:.2f}, and "
                     "see which clock is wrong",
                     camera.name, *later)}};
  }
  constexpr double kTurned = 0.1;
  const Eigen::Matrix3d R_best = bestRotation(pairs);
  if (given > kTurned && unexplained(pairs, R_best) < std::min(kExplained, given / 2.0)) {
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
                                std::size_t most) {
  const Frames frames = firstCamera(recording);
  if (frames.size() < 2 || samples.size() < 2) return {};
  const CameraCalibration& calibration = recording.calibration.cameras.front();
  const CameraModel camera(calibration);
  std::vector<Turn> turns;
  for (const auto& [begin, end] : liveliestRuns(liveliness(frames, samples), most)) {
    cv::Mat before;
    for (std::size_t i = begin; i <= end; ++i) {
      const auto image = replay::monoImageOf(*frames[i]);
      const bool fits = image && image->cols == static_cast<int>(calibration.width) &&
                        image->rows == static_cast<int>(calibration.height);
      const cv::Mat now = fits ? *image : cv::Mat();
      if (i > begin && !before.empty() && !now.empty()) {
        const auto flow = flowBetween(camera, before, now);
        if (!flow.empty()) {
          turns.push_back({frames[i - 1]->time, frames[i]->time, rotationOf(flow)});
        }
      }
      before = now;
    }
  }
  return turns;
}

replay::DataFindings judgeTurns(const std::vector<Turn>& turns,
                                const std::vector<ImuSample>& samples,
                                const CameraCalibration& camera) {
  const GyroIntegral gyro(samples);
  const Pairs pairs = pairsOf(turns, gyro, durationFromSeconds(camera.time_offset_s));
  if (pairs.images.cols() < static_cast<Eigen::Index>(kLeastTurns)) return {};
  const double by_gyro = rms(pairs.gyro), by_images = rms(pairs.images);
  auto findings = judgeScale(by_gyro, by_images, camera.fx);
  if (!findings.empty()) return findings;
  if (std::min(by_gyro, by_images) * camera.fx < kEnough_px) return {};
  return judgePlace(turns, gyro, pairs, camera);
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
  CameraCalibration at_images = camera;  // poses are of the images' times
  at_images.time_offset_s = 0.0;
  const GyroIntegral poses(samples);
  const Pairs pairs = pairsOf(turns, poses, Duration(0));
  if (pairs.images.cols() < static_cast<Eigen::Index>(kLeastTurns)) return {};
  if (rms(pairs.images) * camera.fx < kEnough_px) return {};
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
