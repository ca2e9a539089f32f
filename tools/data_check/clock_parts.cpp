#include "tools/data_check/clock_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
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

/// A deviation in standard deviations, limited, because a part that contains a step may deviate.
double costOf(double off_s, double sigma_s) {
  constexpr double kLeast_s = 0.003, kMost = 6.0;
  return std::min(kMost, std::abs(off_s) / std::hypot(kLeast_s, sigma_s));
}

double deviationsOf(const Parts& parts, const Course& course) {
  double sum = 0.0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const double at = course.split == 0
                          ? course.change * toSeconds(timeOf(parts[i]) - timeOf(parts[0]))
                      : i < course.split ? 0.0
                                         : course.change;
    sum += costOf(parts[i].offset_s - course.first - at, parts[i].sigma_s);
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

/// A long or short interval before a stamp: a pause, lost data, or a clock that was set.
struct Jump {
  TimePoint time;
  double excess_s = 0.0;  ///< of the interval over the usual one
  bool of_imu = false;
};
using Jumps = std::vector<Jump>;

void addJumps(const Stamps& stamps, bool of_imu, Jumps& jumps) {
  constexpr double kLeast_s = 0.01, kSpreads = 8.0;
  std::vector<double> spread;
  for (const double one : stamps.intervals) spread.push_back(std::abs(one - stamps.usual));
  const double least = std::max(kLeast_s, kSpreads * medianOf(std::move(spread)));
  for (std::size_t i = 0; i < stamps.intervals.size(); ++i) {
    const double excess = stamps.intervals[i] - stamps.usual;
    if (std::abs(excess) > least) jumps.push_back({stamps.times[i + 1], excess, of_imu});
  }
}

/// The largest jumps, in the order of time.
Jumps jumpsIn(const replay::Recording& recording) {
  constexpr std::size_t kMost = 8;
  Jumps jumps;
  addJumps(Stamps(recording.imu), true, jumps);
  addJumps(Stamps(framesOf(recording)), false, jumps);
  std::ranges::sort(jumps, std::greater<>(),
                    [](const Jump& one) { return std::abs(one.excess_s); });
  jumps.resize(std::min(jumps.size(), kMost));
  std::ranges::sort(jumps, {}, &Jump::time);
  return jumps;
}

/// The deviations of the parts if each of these jumps is a clock that was set.
double deviationsAfter(const Parts& parts, const Jumps& set) {
  constexpr double kEach = 1.0, kInside = 1.0;  // of an assumption, and of a part with a jump in it
  std::vector<double> offsets, sigmas;
  for (const PartOffset& part : parts) {
    double change = 0.0;
    bool inside = false;
    for (const Jump& jump : set) {
      inside = inside || (jump.time > part.from && jump.time <= part.to);
      if (jump.time <= part.from) change += jump.of_imu ? jump.excess_s : -jump.excess_s;
    }
    if (inside) continue;
    offsets.push_back(part.offset_s - change), sigmas.push_back(part.sigma_s);
  }
  double sum = kEach * static_cast<double>(set.size()) +
               kInside * static_cast<double>(parts.size() - offsets.size());
  if (offsets.empty()) return sum;
  const double first = medianOf(std::vector<double>(offsets));
  for (std::size_t i = 0; i < offsets.size(); ++i) sum += costOf(offsets[i] - first, sigmas[i]);
  return sum;
}

/// The jumps of the stamps that explain the offsets best; none if they need no explanation.
struct Explained {
  Jumps set;
  double worst = 0.0;  ///< sum of the deviations
};

Explained explainedBy(const Jumps& jumps, const Parts& parts) {
  Explained best{{}, deviationsAfter(parts, {})};
  for (unsigned chosen = 1; chosen < 1U << jumps.size(); ++chosen) {
    Jumps set;
    for (std::size_t i = 0; i < jumps.size(); ++i) {
      if (chosen >> i & 1U) set.push_back(jumps[i]);
    }
    const double worst = deviationsAfter(parts, set);
    if (worst < best.worst) best = {std::move(set), worst};
  }
  return best;
}

constexpr char kRemove[] = "remove the step from the stamps behind it, or cut the drive there";

std::string textOf(const Jumps& jumps, const std::string& camera) {
  std::string text;
  for (const Jump& jump : jumps) {
    text += fmt::format("{}at {} ns the stamps of {} jump {} by {:.3f} s", text.empty() ? "" : ", ",
                        toNanoseconds(jump.time), jump.of_imu ? "the IMU" : camera,
                        jump.excess_s > 0.0 ? "ahead" : "back", std::abs(jump.excess_s));
  }
  return text;
}

replay::DataFindings jumpsFinding(const Jumps& set, const std::string& camera) {
  return {
      {replay::DataFinding::Grade::kCause, "clock_step",
       fmt::format("{}; without {}, gyroscope and images turn together: {}", textOf(set, camera),
                   set.size() == 1 ? "this step" : "these steps", kRemove)}};
}

replay::DataFindings stepFinding(const Parts& parts, const Course& step,
                                 const replay::Recording& recording, double least_s) {
  const PartOffset &before = parts[step.split - 1], &after = parts[step.split];
  // One part may be off, and long intervals blur the offsets.
  if (step.split < 2 || step.split + 2 > parts.size() || std::abs(step.change) < least_s) return {};
  return {{replay::DataFinding::Grade::kCause, "clock_step",
           fmt::format("between {} and {} ns the clock of {} or of the IMU was set: gyroscope and "
                       "images turn together at an offset of {:.3f} s before and of {:.3f} s "
                       "after; {}",
                       toNanoseconds(timeOf(before)), toNanoseconds(timeOf(after)),
                       recording.calibration.cameras.front().name, step.first,
                       step.first + step.change, kRemove)}};
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
  constexpr std::size_t kFewest = 3, kFewestOfCourse = 4;
  constexpr double kOrdinary = 1.6, kBetter = 0.55, kLeast_s = 0.015, kSurely = 6.0;
  if (parts.size() < kFewest) return {};
  std::ranges::sort(parts, {}, &PartOffset::from);
  const Course constant{.first = medianIn(parts, 0, parts.size()), .split = parts.size()};
  const auto count = static_cast<double>(parts.size());
  const double before = deviationsOf(parts, constant);
  const double enough = std::min(kOrdinary * count, kBetter * before);
  const Course line = lineOf(parts), step = stepOf(parts);
  const Explained jumps = explainedBy(jumpsIn(recording), parts);
  const CameraCalibration& camera = recording.calibration.cameras.front();
  // A step or a rate that the stamps do not show needs a gap of the same length, which is rare.
  constexpr double kRare = 1.5;
  if (!jumps.set.empty() && jumps.worst < std::min({enough, before - kSurely, kRare * line.worst}))
    return jumpsFinding(jumps.set, camera.name);
  if (parts.size() < kFewestOfCourse || !offsetsDiffer(parts)) return {};
  const double lasts = toSeconds(timeOf(parts.back()) - timeOf(parts.front()));
  const double least =
      std::max(kLeast_s, least_s ? *least_s : Stamps(framesOf(recording)).usual / 3.0);
  if (line.worst <= kRare * step.worst && line.worst < enough &&
      std::abs(line.change) * lasts > least)
    return rateFinding(line.change, camera);
  if (step.worst < enough && std::abs(step.change) > kLeast_s)
    return stepFinding(parts, step, recording, least);
  return {};
}

std::string suspectJumps(const replay::Recording& recording) {
  constexpr double kWhole = 0.15;
  Stamps images(framesOf(recording));
  std::ranges::sort(images.intervals);
  const double each =
      images.intervals.empty() ? 1.0 : images.intervals[images.intervals.size() / 8];
  Jumps jumps = jumpsIn(recording);
  std::erase_if(jumps, [&](const Jump& jump) {  // lost images
    const double times = jump.excess_s / std::max(1e-3, each);
    return !jump.of_imu && std::abs(times - std::round(times)) < kWhole;
  });
  return textOf(jumps, recording.calibration.cameras.front().name);
}

replay::DataFindings checkImuGaps(const replay::Recording& recording) {
  constexpr double kLeast_s = 0.2, kIntervals = 20.0;
  const Stamps imu(recording.imu);
  for (std::size_t i = 0; i < imu.intervals.size(); ++i) {
    if (imu.intervals[i] < std::max(kLeast_s, kIntervals * imu.usual)) continue;
    const TimePoint from = imu.times[i], to = imu.times[i + 1];
    const bool seen = std::ranges::any_of(
        recording.frames, [&](const auto& frame) { return frame.time > from && frame.time < to; });
    if (!seen) continue;
    return {
        {replay::DataFinding::Grade::kWarning, "imu_gap",
         fmt::format("no inertial samples for {:.2f} s from {} ns, while the images go on: they "
                     "were lost, or the IMU's clock was set; record again, or cut the drive "
                     "there",
                     imu.intervals[i], toNanoseconds(from))}};
  }
  return {};
}

}  // namespace perdure::tools
