#include "tools/data_check/samples/sample_blocks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/algorithms/median.h"
#include "tools/data_check/motion_check.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::tools {
namespace {

using Samples = std::vector<ImuSample>;

struct SampleBlock {
  bool of_gyro = true;
  std::size_t first = 0, count = 0;
  std::string axes = {};
  double value = 0.0;
  std::size_t end() const { return first + count; }
};

const Eigen::Vector3d& readingOf(const ImuSample& sample, bool of_gyro) {
  return of_gyro ? sample.gyro : sample.accel;
}

/// Number of samples from `first` that keep a value far from those before and after; 0: none.
std::size_t blockAt(const Samples& samples, std::size_t first, bool of_gyro, Eigen::Index axis) {
  constexpr std::size_t kMost = 20;
  constexpr double kLeast_rad_s = 3.0, kLeast_m_s2 = 40.0, kSame = 1e-6, kBack = 0.3;
  const auto value = [&](std::size_t i) { return readingOf(samples[i], of_gyro)[axis]; };
  const double before = value(first - 1), jump = std::abs(value(first) - before);
  if (jump < (of_gyro ? kLeast_rad_s : kLeast_m_s2)) return 0;
  std::size_t end = first + 1;
  while (end < samples.size() && end - first <= kMost &&
         std::abs(value(end) - value(first)) <= kSame * jump) {
    ++end;
  }
  if (end == samples.size() || end - first > kMost) return 0;
  // Few equal samples of the accelerometer may be a shock, at a lower rate or at the limit.
  if (!of_gyro && end - first < 3) return 0;
  return std::abs(value(end) - before) <= kBack * jump ? end - first : 0;
}

/// The median change of a sensor from sample to sample.
double usualChange(const Samples& samples, bool of_gyro) {
  std::vector<double> changes;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    changes.push_back((readingOf(samples[i], of_gyro) - readingOf(samples[i - 1], of_gyro)).norm());
  }
  return medianOf(std::move(changes));
}

/// Whether the other sensor, whose change is `usual`, shows no shock beside the block.
bool isAlone(const Samples& samples, const SampleBlock& block, double usual) {
  constexpr double kMost = 12.0, kLeast_rad_s = 0.05, kLeast_m_s2 = 2.0;
  const double least = std::max(kMost * usual, block.of_gyro ? kLeast_m_s2 : kLeast_rad_s);
  for (std::size_t i = block.first; i <= block.end(); ++i) {
    const Eigen::Vector3d change =
        readingOf(samples[i], !block.of_gyro) - readingOf(samples[i - 1], !block.of_gyro);
    if (change.norm() > least) return false;
  }
  return true;
}

std::vector<SampleBlock> blocksIn(const Samples& samples, bool of_gyro) {
  std::vector<SampleBlock> blocks;
  const double usual = usualChange(samples, !of_gyro);
  for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
    SampleBlock block{of_gyro, i};
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const std::size_t count = blockAt(samples, i, of_gyro, axis);
      if (count == 0) continue;
      block.count = std::max(block.count, count);
      block.axes += fmt::format("{}{}", block.axes.empty() ? "" : ", ", "xyz"[axis]);
      block.value = readingOf(samples[i], of_gyro)[axis];
    }
    if (block.count > 0 && isAlone(samples, block, usual)) blocks.push_back(block);
  }
  return blocks;
}

/// The samples with values between their neighbours in place of the block.
Samples without(const Samples& samples, const SampleBlock& block) {
  Samples fixed = samples;
  const Eigen::Vector3d from = samples[block.first - 1].gyro, to = samples[block.end()].gyro;
  for (std::size_t i = 0; i < block.count; ++i) {
    const double share = static_cast<double>(i + 1) / static_cast<double>(block.count + 1);
    fixed[block.first + i].gyro = from + share * (to - from);
  }
  return fixed;
}

/// The samples and first camera's images beside a block.
replay::Recording around(const replay::Recording& recording, const SampleBlock& block) {
  constexpr Duration kBeside = std::chrono::milliseconds(400);
  const TimePoint from = recording.imu[block.first].time - kBeside,
                  to = recording.imu[block.end()].time + kBeside;
  replay::Recording part;
  part.calibration = recording.calibration;
  for (const auto& frame : recording.frames) {
    if (frame.camera == 0 && frame.time >= from && frame.time <= to) part.frames.push_back(frame);
  }
  return part;
}

/// Squared sum of the differences between images and gyroscope.
double differenceOf(const std::vector<Turn>& turns, const Samples& samples,
                    const CameraCalibration& camera) {
  const TurnIntegral gyro(samples);
  const Duration later = durationFromSeconds(camera.time_offset_s);
  double sum = 0.0;
  for (const Turn& turn : turns) {
    if (!gyro.covers(turn.from + later, turn.to + later)) continue;
    sum += (camera.T_BC.q * turn.of_images - gyro.between(turn.from + later, turn.to + later))
               .squaredNorm();
  }
  return sum;
}

bool isRefuted(const replay::Recording& recording, const SampleBlock& block) {
  constexpr double kBetter = 0.3, kEnough_px = 1.0;
  const CameraCalibration& camera = recording.calibration.cameras.front();
  const auto turns = turnsAlong(around(recording, block));
  const double given = differenceOf(turns, recording.imu, camera),
               fixed = differenceOf(turns, without(recording.imu, block), camera);
  return camera.fx * std::sqrt(given) > kEnough_px && fixed < kBetter * given;
}

}  // namespace

replay::DataFindings checkSampleBlocks(const replay::Recording& recording) {
  constexpr std::size_t kMostTried = 3, kShare = 50;
  const Samples& samples = recording.imu;
  for (const bool of_gyro : {true, false}) {
    auto blocks = blocksIn(samples, of_gyro);
    if (kShare * blocks.size() > samples.size()) continue;  // the sensor is so
    if (of_gyro) {
      std::vector<SampleBlock> some(
          blocks.begin(),
          blocks.begin() + static_cast<std::ptrdiff_t>(std::min(blocks.size(), kMostTried)));
      if (!std::ranges::all_of(some, [&](auto& block) { return isRefuted(recording, block); }))
        continue;
    }
    if (blocks.empty()) continue;
    const SampleBlock& block = blocks.front();
    return {
        {replay::DataFinding::Grade::kCause, "imu_block",
         fmt::format(
             "the {} reads {:.4g} {} about {} in {} sample{} from {} ns (number {}), jumps there "
             "and back at once{}, while {}: corrupt data; remove these lines",
             of_gyro ? "gyroscope" : "accelerometer", block.value, of_gyro ? "rad/s" : "m/s²",
             block.axes, block.count, block.count > 1 ? "s" : "",
             toNanoseconds(samples[block.first].time), block.first + 1,
             blocks.size() > 1 ? fmt::format(", and at {} other places", blocks.size() - 1) : "",
             of_gyro ? "the images do not turn so" : "the gyroscope shows no shock")}};
  }
  return {};
}

}  // namespace perdure::tools
