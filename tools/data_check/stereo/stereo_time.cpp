#include "tools/data_check/stereo/stereo_time.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "tools/data_check/motion_check.h"

namespace perdure::tools {
namespace {

using Eigen::Vector3d;
using replay::Recording;

constexpr double kLooked_s = 4.0, kLongest_s = 2.5;
constexpr double kTurning_px = 2.0;  // least rotation between two images for a judgement
constexpr double kFits = 0.3;        // largest unexplained share of the rotation
constexpr double kClearly = 3.0;     // least factor of improvement

/// The images of one camera between two times, as a recording of one camera.
Recording partOf(const Recording& recording, std::size_t camera, TimePoint from, TimePoint to) {
  Recording part;
  part.calibration.cameras = {recording.calibration.cameras[camera]};
  for (const auto& frame : recording.frames) {
    if (frame.camera != camera || frame.time < from || frame.time > to) continue;
    part.frames.push_back(frame);
    part.frames.back().camera = 0;
  }
  return part;
}

/// The rotations of all image pairs, transformed to B.
std::vector<Turn> turnsIn(const Recording& part) {
  if (part.frames.size() < 2) return {};
  std::vector<ImuSample> span(2);
  span[0].time = part.frames.front().time, span[1].time = part.frames.back().time;
  auto turns = turnsOfImages(part, span, part.frames.size());
  const Eigen::Matrix3d R_BC = part.calibration.cameras.front().T_BC.R();
  for (Turn& turn : turns) turn.of_images = R_BC * turn.of_images;
  return turns;
}

/// Rotation between two times, composed of consecutive rotations; empty if they have a gap.
std::optional<Vector3d> turnedBetween(const std::vector<Turn>& turns, TimePoint from,
                                      TimePoint to) {
  Vector3d sum = Vector3d::Zero();
  Duration covered{0};
  for (const Turn& turn : turns) {
    const TimePoint begin = std::max(from, turn.from), end = std::min(to, turn.to);
    if (end <= begin) continue;
    covered += end - begin;
    sum += toSeconds(end - begin) / toSeconds(turn.to - turn.from) * turn.of_images;
  }
  if (covered + std::chrono::microseconds(1) < to - from) return std::nullopt;
  return sum;
}

/// Share of the second camera's rotation that the first camera's, shifted by `later`, does not
/// explain.
double leftOver(const std::vector<Turn>& first, const std::vector<Turn>& second, double later) {
  std::vector<std::pair<Vector3d, Vector3d>> both;
  Vector3d mean = Vector3d::Zero(), mean_of_first = Vector3d::Zero();
  for (const Turn& turn : second) {
    const Duration shift = durationFromSeconds(later);
    const auto of_first = turnedBetween(first, turn.from + shift, turn.to + shift);
    if (!of_first) continue;
    both.emplace_back(*of_first, turn.of_images);
    mean_of_first += *of_first, mean += turn.of_images;
  }
  if (2 * both.size() < second.size() || both.size() < 10) return 1.0;
  mean /= static_cast<double>(both.size()), mean_of_first /= static_cast<double>(both.size());
  double left = 0.0, all = 1e-12;
  for (const auto& [a, b] : both) {
    left += ((b - mean) - (a - mean_of_first)).squaredNorm();
    all += (b - mean).squaredNorm();
  }
  return left / all;
}

double changeOf(const std::vector<Turn>& turns) {
  Vector3d mean = Vector3d::Zero();
  for (const Turn& turn : turns) mean += turn.of_images / static_cast<double>(turns.size());
  double sum = 0.0;
  for (const Turn& turn : turns) sum += (turn.of_images - mean).squaredNorm();
  return std::sqrt(sum / std::max<double>(1.0, static_cast<double>(turns.size())));
}

/// Start of the interval in which the IMU's rates vary most; without samples, of the middle
/// interval.
TimePoint liveliest(const Recording& recording, TimePoint first, TimePoint last) {
  const Duration length = durationFromSeconds(kLooked_s);
  TimePoint best = first + std::max(Duration(0), (last - first - length) / 2);
  double most = 0.0;
  for (TimePoint begin = first; begin + length <= last; begin += length / 4) {
    Vector3d sum = Vector3d::Zero();
    double squares = 0.0, count = 0.0;
    for (const ImuSample& sample : recording.imu) {
      if (sample.time < begin || sample.time > begin + length) continue;
      sum += sample.gyro, squares += sample.gyro.squaredNorm(), count += 1.0;
    }
    if (count < 2.0) continue;
    const double change = squares / count - (sum / count).squaredNorm();
    if (change > most) most = change, best = begin;
  }
  return best;
}

}  // namespace

std::optional<double> lateStampsOfSecond(const Recording& recording) {
  std::optional<TimePoint> first, last;
  for (const auto& frame : recording.frames) {
    if (frame.camera != 1) continue;
    if (!first) first = frame.time;
    last = frame.time;
  }
  if (!first) return std::nullopt;
  const TimePoint from = liveliest(recording, *first, *last);
  const TimePoint to = from + durationFromSeconds(kLooked_s);
  const auto second = turnsIn(partOf(recording, 1, from, to));
  if (changeOf(second) * recording.calibration.cameras[1].fx < kTurning_px) return std::nullopt;
  const Duration more = durationFromSeconds(kLongest_s);
  const auto of_first = turnsIn(partOf(recording, 0, from - more, to + more));
  const double own = leftOver(of_first, second, 0.0);
  double best = std::min(kFits, own / kClearly);
  std::optional<double> found;
  for (int step = -250; step <= 250; ++step) {
    const double later = 0.01 * step;
    const double left = leftOver(of_first, second, later);
    if (left < best) best = left, found = later;
  }
  if (!found || std::abs(*found) < 0.02) return std::nullopt;
  return -*found;
}

}  // namespace perdure::tools
