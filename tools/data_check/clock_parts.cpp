#include "tools/data_check/clock_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/base/algorithms/median.h"
#include "tools/data_check/clock_shift.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::tools {
namespace {

using Parts = std::vector<PartOffset>;
using TurnsAt = std::vector<Turn>::const_iterator;

/// Share of the rotation that the gyroscope does not explain at an offset; 1 without samples.
double leftIn(TurnsAt first, TurnsAt last, const TurnIntegral& gyro, const Eigen::Matrix3d& R_CB,
              double offset_s) {
  const Duration later = durationFromSeconds(offset_s);
  std::vector<Eigen::Vector3d> images, said;
  for (auto turn = first; turn != last; ++turn) {
    if (!gyro.covers(turn->from + later, turn->to + later)) return 1.0;
    images.push_back(turn->of_images);
    said.push_back(gyro.between(turn->from + later, turn->to + later));
  }
  return TurnPairs(images, said).unexplained(R_CB);
}

double turningOf(TurnsAt first, TurnsAt last) {
  std::vector<Eigen::Vector3d> images;
  for (auto turn = first; turn != last; ++turn) images.push_back(turn->of_images);
  return TurnPairs(images, images).turning();
}

std::optional<PartOffset> offsetOf(TurnsAt first, TurnsAt last, const TurnIntegral& gyro,
                                   const CameraCalibration& camera) {
  constexpr int kSteps = 40, kApart = 8;
  constexpr double kStep_s = 0.01, kEnough_px = 0.7, kMostLeft = 0.3, kTimesLeft = 2.0;
  if (turningOf(first, last) * camera.fx < kEnough_px) return std::nullopt;
  const Eigen::Matrix3d R_CB = camera.T_BC.R().transpose();
  std::vector<double> left;
  for (int i = -kSteps; i <= kSteps; ++i) {
    left.push_back(leftIn(first, last, gyro, R_CB, camera.time_offset_s + i * kStep_s));
  }
  const auto best = std::ranges::min_element(left);
  if (best == left.begin() || best + 1 == left.end() || *best > kMostLeft) return std::nullopt;
  if (std::max(best[-1], best[1]) >= 1.0) return std::nullopt;  // samples are missing there
  for (auto other = left.begin(); other != left.end(); ++other) {
    if (std::abs(other - best) > kApart && *other < kTimesLeft * *best) return std::nullopt;
  }
  const double bend = best[-1] - 2.0 * *best + best[1];
  if (bend <= 0.0) return std::nullopt;
  const double vertex = 0.5 * (best[-1] - best[1]) / bend;
  const auto step = static_cast<double>(best - left.begin() - kSteps);
  const auto count = static_cast<double>(last - first);
  // The rotation between two images is not known more exactly in time than by a part of its span.
  constexpr double kOfInterval = 0.05;
  const double interval = toSeconds((last - 1)->to - first->from) / count;
  const double sigma = kStep_s * std::sqrt(2.0 * std::max(*best, 1e-4) / (3.0 * count * bend));
  return PartOffset{first->from, (last - 1)->to, camera.time_offset_s + kStep_s * (step + vertex),
                    std::hypot(sigma, kOfInterval * interval)};
}

TimePoint timeOf(const PartOffset& part) { return part.from + (part.to - part.from) / 2; }

/// Offsets by part: those before a step and those after it, or on a line.
struct Course {
  double first = 0.0, change = 0.0;  ///< s; of a line: at the first part, per second
  double worst = 0.0;                ///< sum of the deviations, each limited
  std::size_t split = 0;             ///< number of parts before the step; 0: a line
};

/// Adds the deviations of the parts, in standard deviations and limited; a part that contains the
/// step may deviate.
double deviationsOf(const Parts& parts, const Course& course) {
  constexpr double kLeast_s = 0.003, kMost = 6.0;
  double sum = 0.0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const double at = course.split == 0
                          ? course.change * toSeconds(timeOf(parts[i]) - timeOf(parts[0]))
                      : i < course.split ? 0.0
                                         : course.change;
    const double off = std::abs(parts[i].offset_s - course.first - at);
    sum += std::min(kMost, off / std::hypot(kLeast_s, parts[i].sigma_s));
  }
  return sum;
}

double medianIn(const Parts& parts, std::size_t first, std::size_t last) {
  std::vector<double> offsets;
  for (std::size_t i = first; i < last; ++i) offsets.push_back(parts[i].offset_s);
  return medianOf(std::move(offsets));
}

/// The line through the medians of all pairs' slopes (Theil and Sen).
Course lineOf(const Parts& parts) {
  std::vector<double> slopes, firsts;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (std::size_t k = i + 1; k < parts.size(); ++k) {
      const double apart = toSeconds(timeOf(parts[k]) - timeOf(parts[i]));
      if (apart > 0.5) slopes.push_back((parts[k].offset_s - parts[i].offset_s) / apart);
    }
  }
  if (slopes.empty()) return {.worst = 1e9};
  Course line{.change = medianOf(std::move(slopes))};
  for (const auto& part : parts) {
    firsts.push_back(part.offset_s - line.change * toSeconds(timeOf(part) - timeOf(parts[0])));
  }
  line.first = medianOf(std::move(firsts));
  line.worst = deviationsOf(parts, line);
  return line;
}

Course stepOf(const Parts& parts) {
  Course best{.worst = 1e9};
  for (std::size_t split = 1; split < parts.size(); ++split) {
    Course step{.first = medianIn(parts, 0, split), .split = split};
    step.change = medianIn(parts, split, parts.size()) - step.first;
    step.worst = deviationsOf(parts, step);
    if (step.worst < best.worst) best = step;
  }
  return best;
}

/// The stamps of a sensor, with its intervals and their median in s.
struct Stamps {
  std::vector<TimePoint> times;
  std::vector<double> intervals;
  double usual = 0.0;

  template <class Items>
  explicit Stamps(const Items& items) {
    for (const auto& item : items) {
      if (!times.empty()) intervals.push_back(toSeconds(item.time - times.back()));
      times.push_back(item.time);
    }
    if (!intervals.empty()) usual = medianOf(std::vector<double>(intervals));
  }
};

std::vector<replay::Recording::FrameFile> framesOf(const replay::Recording& recording) {
  auto frames = recording.frames;
  std::erase_if(frames, [](const auto& frame) { return frame.camera != 0; });
  return frames;
}

/// The stamp between two times before which the interval contains a step of about `change_s`.
struct StampStep {
  TimePoint time;
  double off_s = 1e9;     ///< difference of `excess_s` from `change_s`
  double excess_s = 0.0;  ///< of the interval over the usual one
};

StampStep stepIn(const Stamps& stamps, TimePoint from, TimePoint to, double change_s) {
  StampStep best;
  for (std::size_t i = 0; i < stamps.intervals.size(); ++i) {
    if (stamps.times[i] < from || stamps.times[i + 1] > to) continue;
    const double excess = stamps.intervals[i] - stamps.usual, off = std::abs(excess - change_s);
    if (off < best.off_s) best = {stamps.times[i + 1], off, excess};
  }
  return best;
}

replay::DataFindings stepFinding(const Parts& parts, const Course& step,
                                 const replay::Recording& recording, double least_s) {
  const PartOffset &before = parts[step.split - 1], &after = parts[step.split];
  const double near_s =
      std::min(std::max(0.02, 0.25 * std::abs(step.change)), 0.5 * std::abs(step.change));
  const Duration beside = std::chrono::milliseconds(500);
  const StampStep imu = stepIn(Stamps(recording.imu), before.from - beside, after.to + beside,
                               step.change),
                  images = stepIn(Stamps(framesOf(recording)), before.from, after.to, -step.change);
  const StampStep& found = imu.off_s <= images.off_s ? imu : images;
  const bool seen = found.off_s < near_s;
  // Without a stamp that jumps, one part may be off, and long intervals blur the offsets.
  if (!seen && (step.split < 2 || step.split + 2 > parts.size() || std::abs(step.change) < least_s))
    return {};
  const std::string of_camera = recording.calibration.cameras.front().name;
  const std::string place =
      seen ? fmt::format("at {} ns the stamps of {} jump {} by {:.3f} s", toNanoseconds(found.time),
                         &found == &imu ? "the IMU" : of_camera,
                         found.excess_s > 0.0 ? "ahead" : "back", std::abs(found.excess_s))
           : fmt::format("between {} and {} ns the clock of {} or of the IMU was set",
                         toNanoseconds(timeOf(before)), toNanoseconds(timeOf(after)), of_camera);
  return {{replay::DataFinding::Grade::kWarning, "clock_step",
           fmt::format("{}: gyroscope and images turn together at an offset of {:.3f} s before and "
                       "of {:.3f} s after; remove the step from the stamps behind it, or cut the "
                       "drive there",
                       place, step.first, step.first + step.change)}};
}

}  // namespace

Parts offsetsOfParts(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
                     const CameraCalibration& camera) {
  constexpr std::ptrdiff_t kFewest = 8, kMost = 15;
  if (samples.size() < 2) return {};
  const TurnIntegral gyro(samples);
  Parts parts;
  for (auto first = turns.begin(); first != turns.end();) {
    auto last = first + 1;
    while (last != turns.end() && last->from == (last - 1)->to && last - first < kMost) ++last;
    if (last - first >= kFewest) {
      if (const auto part = offsetOf(first, last, gyro, camera)) parts.push_back(*part);
    }
    first = last;
  }
  return parts;
}

bool offsetsDiffer(const Parts& parts) {
  constexpr double kApart_s = 0.012, kSurely = 4.0;
  for (const auto& a : parts) {
    for (const auto& b : parts) {
      const double sigma = std::hypot(a.sigma_s, b.sigma_s);
      if (a.offset_s - b.offset_s > std::max(kApart_s, kSurely * sigma)) return true;
    }
  }
  return false;
}

bool offsetsDiffer(Parts parts, const CameraCalibration& camera) {
  PartOffset given;
  given.offset_s = camera.time_offset_s;
  parts.push_back(given);
  return offsetsDiffer(parts);
}

bool hasStampStep(const replay::Recording& recording) {
  constexpr double kOfImu = 2.0, kOfImages = 0.6;
  // Intervals of whole multiples are due to lost data.
  const auto isIrregular = [](const Stamps& stamps, double share) {
    constexpr double kLeast_s = 0.04, kWhole = 0.15;
    const double off = std::max(kLeast_s, share * stamps.usual);
    return std::ranges::any_of(stamps.intervals, [&](double one) {
      const double times = one / stamps.usual;
      return std::abs(one - stamps.usual) > off &&
             (times < 1.5 || std::abs(times - std::round(times)) > kWhole);
    });
  };
  return isIrregular(Stamps(recording.imu), kOfImu) ||
         isIrregular(Stamps(framesOf(recording)), kOfImages);
}

replay::DataFindings judgeParts(Parts parts, const replay::Recording& recording,
                                std::optional<double> least_s) {
  constexpr std::size_t kFewest = 4;
  constexpr double kOrdinary = 1.6, kBetter = 0.55, kLeast_s = 0.015;
  if (parts.size() < kFewest || !offsetsDiffer(parts)) return {};
  std::ranges::sort(parts, {}, &PartOffset::from);
  const Course line = lineOf(parts), step = stepOf(parts);
  const Course constant{.first = medianIn(parts, 0, parts.size()), .split = parts.size()};
  const auto count = static_cast<double>(parts.size());
  const double enough = std::min(kOrdinary * count, kBetter * deviationsOf(parts, constant));
  const double lasts = toSeconds(timeOf(parts.back()) - timeOf(parts.front()));
  const double least =
      std::max(kLeast_s, least_s ? *least_s : Stamps(framesOf(recording)).usual / 3.0);
  if (line.worst <= step.worst && line.worst < enough && std::abs(line.change) * lasts > least)
    return rateFinding(line.change, recording.calibration.cameras.front());
  if (step.worst < enough && std::abs(step.change) > kLeast_s)
    return stepFinding(parts, step, recording, least);
  return {};
}

}  // namespace perdure::tools
