#include "common/replay/data_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "common/base/algorithms/median.h"
#include "common/base/errors.h"
#include "common/replay/clock_check.h"
#include "common/replay/image_check.h"

namespace perdure::replay {
namespace {

using Grade = DataFinding::Grade;

/// A wrong unit of the accelerometer. It is recognised by a median force between `low` and `high`.
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
  // The ranges contain gravity in each unit, with a margin for motion.
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

/// Adds images_upside_down if the mean specific force, which points upwards, points down in the
/// image.
void checkUpright(const Recording& recording, DataFindings& findings) {
  if (recording.imu.size() < 20 || recording.calibration.cameras.empty()) return;
  const CameraCalibration& camera = recording.calibration.cameras.front();
  if (camera.fx <= 0.0) return;  // the pose is not known either
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : recording.imu) sum += sample.accel;
  const Eigen::Vector3d up_C = camera.T_BC.q.conjugate() * sum.normalized();
  constexpr double kSurely = 0.8;  // cosine of 37°
  if (!(up_C.y() > kSurely)) return;
  findings.push_back(
      {Grade::kNote, "images_upside_down",
       fmt::format("{}: by T_BS and the accelerometer {} hangs so; where it does not, see T_BS and "
                   "the signs of the accelerometer (at rest it reads +9.8 along what points up)",
                   kUpsideDown, camera.name)});
}

/// Adds lines_lost if more than one line per kFew was left out. Smaller losses are only counted.
void checkLost(const Recording& recording, const DataUse& use, DataFindings& findings) {
  constexpr std::uint64_t kFew = 20;  // accepts one lost line per this number of lines
  const std::uint64_t images = recording.frames.size(), samples = recording.imu.size();
  for (const auto& [kind, kept] : {std::pair("imu", use.imu ? samples : 0), {"frame", images}}) {
    std::uint64_t lost = 0;
    for (const char* reason : {"_malformed", "_stray"}) {
      lost += recording.reasons.of(std::string(kind) + reason);
    }
    if (kept == 0 || kFew * lost <= kept) continue;
    findings.push_back({Grade::kWarning, "lines_lost",
                        fmt::format("{} of {} {} were left out, because their lines cannot be read "
                                    "or their stamps are far from their neighbours'; the notes say "
                                    "where; record or copy them again",
                                    lost, kept + lost,
                                    std::string(kind) == "imu" ? "inertial samples" : "images")});
  }
  const std::uint64_t named = recording.reasons.of("frame_not_increasing"),
                      unlisted = std::max(named, recording.reasons.of("frame_unlisted")) - named;
  if (kFew * unlisted > images) {
    findings.push_back({Grade::kWarning, "lines_lost",
                        fmt::format("{} images lie in the folder but not in its data.csv and were "
                                    "left out: complete the list, or remove them",
                                    unlisted)});
  }
}

/// The first and last sample of a run.
struct Run {
  std::size_t first = 0, last = 0;
  std::size_t count() const { return last - first + 1; }
};

/// The longest run of samples that are the `same` as its first one.
template <class Same>
Run longestRun(const std::vector<ImuSample>& samples, const Same& same) {
  Run longest;
  for (std::size_t from = 0, i = 1; i < samples.size(); ++i) {
    if (!same(samples[from], samples[i])) from = i;
    if (i - from > longest.last - longest.first) longest = {from, i};
  }
  return longest;
}

/// "from … to … ns (… s, … samples)"
std::string placeOf(const Run& run, const std::vector<ImuSample>& samples) {
  const TimePoint from = samples[run.first].time, to = samples[run.last].time;
  return fmt::format("from {} to {} ns ({:.1f} s, {} samples)", toNanoseconds(from),
                     toNanoseconds(to), toSeconds(to - from), run.count());
}

/// Adds imu_repeats for the longest run of equal samples, if it is long: noise changes each sample
/// of a sensor that measures.
void checkRepeatedSamples(const std::vector<ImuSample>& samples, DataFindings& findings) {
  constexpr std::size_t kRepeated = 20;
  constexpr Duration kLeast = std::chrono::milliseconds(300);
  const Run run = longestRun(samples, [](const ImuSample& a, const ImuSample& b) {
    return a.gyro == b.gyro && a.accel == b.accel;
  });
  const bool all = run.count() == samples.size();  // made without noise
  if (all || run.count() <= kRepeated || samples[run.last].time - samples[run.first].time < kLeast)
    return;
  findings.push_back({Grade::kCause, "imu_repeats",
                      fmt::format("the IMU repeats one sample {}: its driver or its recorder "
                                  "stood still; cut the drive there",
                                  placeOf(run, samples))});
}

/// A value of a sample's six.
double axisValue(const ImuSample& sample, Eigen::Index axis) {
  return axis < 3 ? sample.gyro[axis] : sample.accel[axis - 3];
}

const char* sensorOf(Eigen::Index axis) { return axis < 3 ? "gyroscope" : "accelerometer"; }
const char* unitOf(Eigen::Index axis) { return axis < 3 ? "rad/s" : "m/s²"; }

/// The share of the samples of a run at which both other axes of the sensor change.
double shareOfChanges(const std::vector<ImuSample>& samples, const Run& run, Eigen::Index axis) {
  const Eigen::Index sensor = axis / 3 * 3;
  std::size_t changes = 0;
  for (std::size_t i = run.first + 1; i <= run.last; ++i) {
    bool both = true;
    for (Eigen::Index other = sensor; other < sensor + 3; ++other) {
      both &= other == axis || axisValue(samples[i], other) != axisValue(samples[i - 1], other);
    }
    changes += both ? 1 : 0;
  }
  return static_cast<double>(changes) / static_cast<double>(run.count());
}

/// Whether the value of a run is the sensor's limit: the axis is never beyond it. An axis that
/// never changes is at its limit if too little is left of gravity.
bool isLimit(const std::vector<ImuSample>& samples, const Run& run, Eigen::Index axis) {
  constexpr double kLeast_m_s2 = 9.4;
  const double value = axisValue(samples[run.first], axis);
  if (run.count() == samples.size()) {
    std::vector<double> forces;
    for (const ImuSample& sample : samples) forces.push_back(sample.accel.norm());
    const double force = medianOf(std::move(forces));
    return force < kLeast_m_s2 && 2.0 * std::abs(value) > force;
  }
  return value != 0.0 && std::ranges::all_of(samples, [&](const ImuSample& sample) {
           return std::copysign(1.0, value) * axisValue(sample, axis) <= std::abs(value);
         });
}

/// Whether the axis has few different values outside of a run, although it changes there.
bool isCoarse(const std::vector<ImuSample>& samples, const Run& run, Eigen::Index axis) {
  constexpr std::size_t kFew = 64;
  std::set<double> values;
  for (std::size_t i = 0; i < samples.size() && values.size() <= kFew; ++i) {
    if (i < run.first || i > run.last) values.insert(axisValue(samples[i], axis));
  }
  return !values.empty() && values.size() <= kFew;
}

/// Adds imu_axis_stuck for an axis that keeps one value while the others of its sensor change.
/// A gyroscope axis that is constant throughout may be that of a body that moves in a plane.
void checkStuckAxes(const std::vector<ImuSample>& samples, DataFindings& findings) {
  constexpr std::size_t kFewestEqual = 100;
  constexpr Duration kLeast = std::chrono::seconds(1);
  constexpr double kChanges = 0.8;
  for (Eigen::Index axis = 0; axis < 6; ++axis) {
    const Run run = longestRun(samples, [axis](const ImuSample& a, const ImuSample& b) {
      return axisValue(a, axis) == axisValue(b, axis);
    });
    if (run.count() < kFewestEqual || samples[run.last].time - samples[run.first].time < kLeast ||
        (axis < 3 && run.count() == samples.size()) || isCoarse(samples, run, axis) ||
        shareOfChanges(samples, run, axis) < kChanges)
      continue;
    const bool limit = isLimit(samples, run, axis);
    findings.push_back(
        {Grade::kCause, limit ? "imu_saturated" : "imu_axis_stuck",
         fmt::format("the {} reads exactly {:.6g} {} along {} {}{}", sensorOf(axis),
                     axisValue(samples[run.first], axis), unitOf(axis), "xyz"[axis % 3],
                     placeOf(run, samples),
                     limit ? " and never more: it is saturated; set a larger range of the sensor"
                     : run.count() == samples.size()
                         ? ", while its other axes change: this axis is off, has failed, or its "
                           "column was not recorded; record again"
                         : ", while its other axes change: this axis is off, has failed, or its "
                           "column was not recorded; cut the drive there")});
  }
}

/// Adds imu_spike for single samples that are far from both neighbours, which have usual values.
/// Shocks of a body last for several samples.
void checkSpikes(const std::vector<ImuSample>& samples, DataFindings& findings) {
  constexpr double kLeast_rad_s = 15.0, kLeast_m_s2 = 150.0, kUsual = 0.3;
  for (Eigen::Index axis = 0; axis < 6; ++axis) {
    const double least = axis < 3 ? kLeast_rad_s : kLeast_m_s2;
    std::vector<double> values;
    for (const auto& sample : samples) values.push_back(axisValue(sample, axis));
    const double median = medianOf(std::vector<double>(values));
    std::size_t spikes = 0, first = 0;
    for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
      const auto from_median = [&](std::size_t k) { return std::abs(values[k] - median); };
      const double beside = std::max(from_median(i - 1), from_median(i + 1));
      if (from_median(i) < least || beside > kUsual * from_median(i)) continue;
      if (spikes++ == 0) first = i;
    }
    if (spikes == 0 || 50 * spikes > samples.size()) continue;
    findings.push_back(
        {Grade::kCause, "imu_spike",
         fmt::format("the sample at {} ns{} reads {:.4g} {} about {} of the {}, its neighbours "
                     "{:.3g}: this is a transmission error; remove {}",
                     toNanoseconds(samples[first].time),
                     spikes > 1 ? fmt::format(" (and {} more)", spikes - 1) : "", values[first],
                     unitOf(axis), "xyz"[axis % 3], sensorOf(axis), values[first - 1],
                     spikes > 1 ? "their lines" : "its line")});
    return;
  }
}

/// How an axis of the IMU behaves at its largest value.
struct AtMost {
  double most = 0.0, step = 0.0;  ///< largest absolute value; smallest change
  std::size_t samples = 0;        ///< at the largest value
  std::size_t times = 0;          ///< number of separate episodes
  std::size_t stays = 0;          ///< samples after another one there, while other axes change
  std::size_t near = 0;           ///< samples slightly below
  bool positive = false, negative = false;
};

AtMost atMost(const std::vector<ImuSample>& samples, Eigen::Index axis) {
  constexpr double kNear = 0.85;
  AtMost all;
  for (const auto& sample : samples)
    all.most = std::max(all.most, std::abs(axisValue(sample, axis)));
  all.step = all.most;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double value = axisValue(samples[i], axis), before = axisValue(samples[i - 1], axis);
    if (value != before) all.step = std::min(all.step, std::abs(value - before));
    if (std::abs(value) < all.most) {
      all.near += std::abs(value) > kNear * all.most ? 1 : 0;
      continue;
    }
    ++all.samples;
    (value > 0.0 ? all.positive : all.negative) = true;
    const bool changed = axis < 3 ? samples[i].accel != samples[i - 1].accel
                                  : samples[i].gyro != samples[i - 1].gyro;
    all.times += std::abs(before) < all.most ? 1 : 0;
    all.stays += changed && std::abs(before) == all.most ? 1 : 0;
  }
  return all;
}

/// Adds imu_saturated if an axis stays at its largest value, which it should only touch, while the
/// others change.
void checkSaturated(const std::vector<ImuSample>& samples, DataFindings& findings) {
  constexpr std::size_t kFewestAtMost = 10, kShare = 200, kFewestTimes = 2;
  constexpr double kLeast_rad_s = 0.1, kLeast_m_s2 = 2.0;
  constexpr double kResolution = 100.0;  // largest value, in steps of the sensor
  for (Eigen::Index axis = 0; axis < 6; ++axis) {
    const AtMost at = atMost(samples, axis);
    const bool few = at.samples < kFewestAtMost || kShare * at.samples < samples.size(),
               still = at.most < (axis < 3 ? kLeast_rad_s : kLeast_m_s2),
               coarse = at.most < kResolution * at.step || at.times < kFewestTimes;
    if (few || still || coarse || 2 * at.samples > samples.size() || 2 * at.stays < at.samples ||
        at.samples < at.near)
      continue;
    findings.push_back(
        {Grade::kCause, "imu_saturated",
         fmt::format(
             "the {} reads exactly {}{:.4g} {} about {} in {} samples ({:.0f} %) and never "
             "more: it is saturated; set a larger range of the sensor",
             sensorOf(axis),
             at.positive && at.negative ? "±"
             : at.negative              ? "-"
                                        : "",
             at.most, unitOf(axis), "xyz"[axis % 3], at.samples,
             100.0 * static_cast<double>(at.samples) / static_cast<double>(samples.size()))});
    return;
  }
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
  constexpr double kNoBody = 300.0;  // rad/s, 48 turns a second
  if (turn > kNoBody) {
    findings.push_back(
        {Grade::kFatal, "gyro_scale",
         fmt::format("rates of turn are {:.3g} rad/s (median), which no body reaches: they are in "
                     "thousandths of a degree per second (multiply by 1.74533e-5), or the sensor's "
                     "counts (multiply by the scale of its data sheet)",
                     turn)});
  } else if (turn > 6.0) {
    findings.push_back(
        {Grade::kWarning, "gyro_scale",
         fmt::format("rates of turn are {:.3g} rad/s (median), more than a turn a "
                     "second: are they in degrees per second (then multiply them by 0.0174533), "
                     "or in thousandths of a degree per second (by 1.74533e-5)?",
                     turn)});
  }
  return findings;
}

DataFindings checkData(const Recording& recording, const DataUse& use) {
  DataFindings findings = checkClocks(recording, use);
  checkLost(recording, use, findings);
  const auto isFatal = [](const auto& one) { return one.grade == Grade::kFatal; };
  if (use.imu && std::none_of(findings.begin(), findings.end(), isFatal)) {
    const DataFindings units = checkImuUnits(recording.imu);
    findings.insert(findings.end(), units.begin(), units.end());
    checkRepeatedSamples(recording.imu, findings);
    const std::size_t before = findings.size();
    checkSaturated(recording.imu, findings);
    if (findings.size() == before) checkStuckAxes(recording.imu, findings);
    checkSpikes(recording.imu, findings);
  }
  if (!use.images) return findings;
  if (use.imu) checkUpright(recording, findings);
  for (std::size_t camera = 0; camera < recording.calibration.cameras.size(); ++camera) {
    checkImages(recording, camera, findings);
  }
  return findings;
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
