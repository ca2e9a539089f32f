#include "common/replay/data_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/algorithms/median.h"
#include "common/base/errors.h"
#include "common/replay/image_check.h"
#include "common/replay/stamp_check.h"
#include "common/vision/decode.h"
#include "common/vision/image.h"
#include "common/vision/jpeg.h"

namespace perdure::replay {
namespace {

using Grade = DataFinding::Grade;

/// A range (low, high) of the median that identifies a wrong unit.
struct Unit {
  double low, high;
  const char *code, *text;
};

/// Returns true if the forces have no common direction and widely varying magnitudes. Gravity would
/// give them both a common direction and a similar magnitude.
bool isWithoutGravity(const std::vector<ImuSample>& samples) {
  constexpr double kCommon = 0.4, kSpread = 0.3;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double sizes = 0.0, squares = 0.0;
  for (const ImuSample& sample : samples) {
    sum += sample.accel;
    sizes += sample.accel.norm(), squares += sample.accel.squaredNorm();
  }
  const auto count = static_cast<double>(samples.size());
  const double mean = sizes / count;
  const double deviation = std::sqrt(std::max(0.0, squares / count - mean * mean));
  return sum.norm() < kCommon * sizes && deviation > kSpread * mean;
}

void addForceUnit(const std::vector<ImuSample>& samples, double force, DataFindings& findings) {
  // Gravity is 9.8 m/s²; a moving sensor measures slightly different values.
  constexpr std::array kUnits{
      Unit{0.85, 1.25, "accel_in_g", "the unit is g; multiply the columns by 9.80665"},
      Unit{850, 1250, "accel_in_mg", "the unit is mg; multiply the columns by 0.00980665"},
      Unit{8300, 12300, "accel_in_mm", "the unit is mm/s²; divide the columns by 1000"}};
  const bool without = isWithoutGravity(samples);
  for (const Unit& unit : kUnits) {
    if (without || force < unit.low || force > unit.high) continue;
    findings.push_back({Grade::kFatal, unit.code,
                        fmt::format("the accelerometer measures {:.3g} m/s² (median) where gravity "
                                    "alone is 9.8: {}",
                                    force, unit.text)});
    return;
  }
  if (force < 4.0) {
    findings.push_back(
        {Grade::kFatal, "accel_without_gravity",
         fmt::format(
             "the accelerometer measures {:.3g} m/s² (median) where gravity alone is 9.8: it "
             "seems to be taken away already; write the specific force that the sensor gives, "
             "in m/s²",
             force)});
  } else if (force < 8.0 || force > 13.0) {
    findings.push_back({force > 40.0 ? Grade::kFatal : Grade::kWarning, "accel_scale",
                        fmt::format("the accelerometer measures {:.3g} m/s² (median) where gravity "
                                    "alone is 9.8: see its unit and scale",
                                    force)});
  }
}

/// The range in nanoseconds, which shows the unit of the stamps.
std::string rangeText(TimePoint first, TimePoint last) {
  return fmt::format("{} … {} ns", toNanoseconds(first), toNanoseconds(last));
}

/// A guess at the relation of the two ranges of stamps: a different unit or a different clock.
std::string guessOfClock(TimePoint images, TimePoint imu) {
  const double ratio = static_cast<double>(toNanoseconds(images)) /
                       std::max(1.0, static_cast<double>(toNanoseconds(imu)));
  constexpr std::array<std::pair<double, const char*>, 3> kUnits{
      {{1e3, "microseconds"}, {1e6, "milliseconds"}, {1e9, "seconds"}}};
  for (const auto& [factor, unit] : kUnits) {
    if (std::abs(ratio / factor - 1.0) < 0.05) {
      return fmt::format("the IMU's stamps look like {}: multiply them by {:.0f}", unit, factor);
    }
    if (std::abs(ratio * factor - 1.0) < 0.05) {
      return fmt::format("the images' stamps look like {}: multiply them by {:.0f}", unit, factor);
    }
  }
  return fmt::format(
      "they are {:.9g} s apart: they come from two clocks; add the difference of the clocks to one "
      "of them",
      std::abs(toSeconds(images) - toSeconds(imu)));
}

void checkClocks(const Recording& recording, DataFindings& findings) {
  if (recording.imu.empty() || recording.frames.empty()) return;
  const TimePoint first = recording.frames.front().time, last = recording.frames.back().time;
  const TimePoint from = recording.imu.front().time, to = recording.imu.back().time;
  if (from > last || to < first) {
    findings.push_back(
        {Grade::kFatal, "clocks_apart",
         fmt::format("camera and IMU stamps do not overlap: images {}, inertial "
                     "samples {}; {}",
                     rangeText(first, last), rangeText(from, to), guessOfClock(first, from))});
    return;
  }
  const auto covered =
      std::count_if(recording.frames.begin(), recording.frames.end(),
                    [&](const auto& frame) { return frame.time >= from && frame.time <= to; });
  const auto all = static_cast<std::ptrdiff_t>(recording.frames.size());
  if (2 * covered >= all) return;
  findings.push_back(
      {Grade::kWarning, "imu_covers_part",
       fmt::format("only {} of {} images lie within the time of the inertial samples: "
                   "images {}, samples {}",
                   covered, all, rangeText(first, last), rangeText(from, to))});
}

void checkRate(const Recording& recording, DataFindings& findings) {
  const auto& imu = recording.imu;
  if (!recording.calibration.imu || imu.size() < 10) return;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < imu.size(); ++i)
    intervals.push_back(toSeconds(imu[i].time - imu[i - 1].time));
  const double rate = 1.0 / std::max(1e-9, medianOf(intervals));
  const double said = recording.calibration.imu->rate_hz;
  if (said <= 0.0 || (rate < 1.5 * said && rate > said / 1.5)) return;
  findings.push_back(
      {Grade::kWarning, "imu_rate",
       fmt::format("inertial samples come at {:.4g} Hz, the calibration says {:.4g}: "
                   "see the unit of their stamps, or set rate_hz",
                   rate, said)});
}

/// Checks whether the mean specific force, which points upwards, points down in the image.
void checkUpright(const Recording& recording, DataFindings& findings) {
  if (recording.imu.size() < 20 || recording.calibration.cameras.empty()) return;
  const CameraCalibration& camera = recording.calibration.cameras.front();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : recording.imu) sum += sample.accel;
  const Eigen::Vector3d up_C = camera.T_BC.q.conjugate() * sum.normalized();
  constexpr double kSurely = 0.8;  // cosine of 37°
  if (!(up_C.y() > kSurely)) return;
  findings.push_back(
      {Grade::kWarning, "images_upside_down",
       fmt::format("{}: by T_BS and the accelerometer {} hangs so; where it does not, see T_BS and "
                   "the signs of the accelerometer (at rest it reads +9.8 along what points up)",
                   kUpsideDown, camera.name)});
}

}  // namespace

DataFindings checkImuUnits(const std::vector<ImuSample>& samples) {
  DataFindings findings;
  if (samples.size() < 20) return findings;
  std::vector<double> forces, turns;
  for (const ImuSample& sample : samples) {
    forces.push_back(sample.accel.norm());
    turns.push_back(sample.gyro.norm());
  }
  const double force = medianOf(std::move(forces)), turn = medianOf(std::move(turns));
  if (turn > 8.0 && turn < 13.0 && force < 4.0) {
    findings.push_back(
        {Grade::kFatal, "imu_columns_exchanged",
         fmt::format(
             "what should be rates of turn measures {:.3g} (median), as gravity does, and what "
             "should be accelerations {:.3g}: the columns are exchanged; write w_x, w_y, w_z, "
             "then a_x, a_y, a_z",
             turn, force)});
    return findings;
  }
  addForceUnit(samples, force, findings);
  if (turn > 6.0) {
    findings.push_back(
        {Grade::kWarning, "gyro_scale",
         fmt::format("rates of turn are {:.3g} rad/s (median), more than a turn a "
                     "second: in degrees per second? Then multiply them by 0.0174533",
                     turn)});
  }
  return findings;
}

DataFindings checkData(const Recording& recording, const DataUse& use) {
  DataFindings findings;
  checkStamps(recording, use, findings);
  const auto isFatal = [](const auto& one) { return one.grade == Grade::kFatal; };
  const bool times = std::none_of(findings.begin(), findings.end(), isFatal);
  if (use.imu && times && !recording.imu.empty()) {
    checkClocks(recording, findings);
    checkRate(recording, findings);
    const DataFindings units = checkImuUnits(recording.imu);
    findings.insert(findings.end(), units.begin(), units.end());
  }
  if (!use.images) return findings;
  if (use.imu) checkUpright(recording, findings);
  for (std::size_t camera = 0; camera < recording.calibration.cameras.size(); ++camera) {
    checkImages(recording, camera, findings);
  }
  return findings;
}

Result<cv::Mat> monoImageOf(const Recording::FrameFile& file) {
  if (!file.load) {
    return vision::decodeImageFile(file.path, ImageEncoding::kMono8, vision::usedBits(file.path));
  }
  const auto loaded = file.load();
  if (!loaded) return tl::unexpected(loaded.error());
  const auto frame = vision::decompressed(*loaded);
  if (!frame) return tl::unexpected(frame.error());
  auto image = vision::monoOf(*frame);
  return image ? Result<cv::Mat>(image->clone()) : image;
}

void refuseFatal(const DataFindings& findings, const std::string& where) {
  std::string text;
  for (const DataFinding& finding : findings) {
    if (finding.grade != Grade::kFatal) continue;
    text += (text.empty() ? "" : "\n") + where + ": " + finding.text;
  }
  if (!text.empty()) throw StartupError(ExitCode::kData, text);
}

}  // namespace perdure::replay
