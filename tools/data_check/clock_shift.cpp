#include "tools/data_check/clock_shift.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/replay/clock_check.h"

namespace perdure::tools {
namespace {

using replay::DataFinding;
using replay::Recording;

/// Step of the tested shifts; a rotation of a carried camera takes much longer.
constexpr double kStep_s = 0.01;

/// Integral of the rates on a grid. Rotations between two images are so small that rates can be
/// summed.
class TurnGrid {
 public:
  explicit TurnGrid(const std::vector<ImuSample>& samples) : start_(samples.front().time) {
    constexpr double kHole_s = 0.35;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int holes = 0;
    for (std::size_t i = 1; i < samples.size(); ++i) {
      const double from = toSeconds(samples[i - 1].time - start_),
                   to = toSeconds(samples[i].time - start_);
      if (to - from > kHole_s) ++holes;
      const Eigen::Vector3d rate = 0.5 * (samples[i - 1].gyro + samples[i].gyro);
      for (; static_cast<double>(cells_.size()) * kStep_s <= to; holes_.push_back(holes)) {
        const double at = static_cast<double>(cells_.size()) * kStep_s;
        cells_.push_back(sum + (at - from) * rate);
      }
      sum += (to - from) * rate;
    }
  }
  std::int64_t cells() const { return static_cast<std::int64_t>(cells_.size()); }
  double cellsTo(TimePoint time) const { return toSeconds(time - start_) / kStep_s; }
  std::int64_t cellOf(TimePoint time) const { return std::llround(cellsTo(time)); }
  /// Returns nothing if samples are missing between the two cells.
  std::optional<Eigen::Vector3d> between(std::int64_t from, std::int64_t to) const {
    if (from < 0 || to >= cells()) return std::nullopt;
    const auto a = static_cast<std::size_t>(from), b = static_cast<std::size_t>(to);
    if (holes_[a] != holes_[b]) return std::nullopt;
    return cells_[b] - cells_[a];
  }

 private:
  TimePoint start_;
  std::vector<Eigen::Vector3d> cells_;
  std::vector<int> holes_;
};

/// A rotation of the images, in B, between two cells of the grid.
struct CellTurn {
  std::int64_t from, to;
  Eigen::Vector3d of_images;
};

using CellTurns = std::vector<CellTurn>;

/// Returns nothing if there are too few turns, or if they are too small for a comparison.
CellTurns cellsOf(const std::vector<Turn>& turns, const TurnGrid& gyro,
                  const CameraCalibration& camera) {
  constexpr std::size_t kFewest = 24;
  constexpr double kEnough_px = 2.0;
  if (turns.size() < kFewest) return {};
  CellTurns cells;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double squared = 0.0;
  for (const Turn& turn : turns) {
    cells.push_back({gyro.cellOf(turn.from), gyro.cellOf(turn.to), camera.T_BC.q * turn.of_images});
    sum += turn.of_images, squared += turn.of_images.squaredNorm();
  }
  const auto n = static_cast<double>(turns.size());
  const double turning = std::sqrt(std::max(0.0, squared - sum.squaredNorm() / n) / n);
  return turning * camera.fx < kEnough_px ? CellTurns() : cells;
}

/// t_imu = t_image + shift + rate (t_image − centre), in cells.
struct ClockLine {
  std::int64_t shift = 0, centre = 0;
  double rate = 0.0;
  std::int64_t of(std::int64_t cell) const {
    return cell + shift + std::llround(rate * static_cast<double>(cell - centre));
  }
};

/// Share of the images' rotation that the gyroscope does not explain, without the means. 1 if the
/// gyroscope's samples cover less than half of the turns.
double unexplainedAt(const CellTurns& turns, const TurnGrid& gyro, const ClockLine& line) {
  Eigen::Vector3d images = Eigen::Vector3d::Zero(), off = Eigen::Vector3d::Zero();
  double images_squared = 0.0, off_squared = 0.0;
  std::size_t count = 0;
  for (const CellTurn& turn : turns) {
    const auto given = gyro.between(line.of(turn.from), line.of(turn.to));
    if (!given) continue;
    const Eigen::Vector3d error = turn.of_images - *given;
    images += turn.of_images, images_squared += turn.of_images.squaredNorm();
    off += error, off_squared += error.squaredNorm();
    ++count;
  }
  if (2 * count < turns.size()) return 1.0;
  const auto n = static_cast<double>(count);
  const double all = images_squared - images.squaredNorm() / n;
  return std::min(1.0, (off_squared - off.squaredNorm() / n) / std::max(1e-18, all));
}

/// The minimum of the parabola through three neighbours, in cells from the middle one.
double vertexOf(double before, double middle, double after) {
  const double bend = before - 2.0 * middle + after;
  return bend > 0.0 ? 0.5 * (before - after) / bend : 0.0;
}

/// A match explains all but a share kMostLeft; the second best one leaves kTimesLeft times as much.
constexpr double kMostLeft = 0.3, kTimesLeft = 2.0;

}  // namespace

std::optional<double> shiftOfTurns(const std::vector<Turn>& turns,
                                   const std::vector<ImuSample>& samples,
                                   const CameraCalibration& camera) {
  constexpr double kApart_s = 0.5;
  if (samples.size() < 2) return std::nullopt;
  const TurnGrid gyro(samples);
  const CellTurns cells = cellsOf(turns, gyro, camera);
  if (cells.empty()) return std::nullopt;
  const std::int64_t least = -cells.back().to, most = gyro.cells() - cells.front().from;
  std::vector<double> left;
  for (std::int64_t shift = least; shift <= most; ++shift) {
    left.push_back(unexplainedAt(cells, gyro, {.shift = shift}));
  }
  const auto best = std::min_element(left.begin(), left.end());
  const auto apart = static_cast<std::ptrdiff_t>(kApart_s / kStep_s);
  double second = 1.0;
  for (auto other = left.begin(); other != left.end(); ++other) {
    if (std::abs(other - best) > apart) second = std::min(second, *other);
  }
  if (*best > kMostLeft || kTimesLeft * *best > second) return std::nullopt;
  double shift = static_cast<double>(least + (best - left.begin()));
  if (best != left.begin() && best + 1 != left.end()) shift += vertexOf(best[-1], *best, best[1]);
  double rounded = 0.0;  // images with regular stamps have a common rounding error
  for (std::size_t i = 0; i < turns.size(); ++i) {
    rounded += static_cast<double>(cells[i].from) - gyro.cellsTo(turns[i].from);
  }
  const double seconds = kStep_s * (shift + rounded / static_cast<double>(turns.size()));
  return std::round(1e3 * seconds) / 1e3;
}

std::optional<double> rateOfTurns(const std::vector<Turn>& turns,
                                  const std::vector<ImuSample>& samples,
                                  const CameraCalibration& camera) {
  constexpr double kMostRate = 0.25;
  constexpr std::int64_t kMost = 400, kStep = 4;  // in cells; limits of the shift at both ends
  if (samples.size() < 2) return std::nullopt;
  const TurnGrid gyro(samples);
  const CellTurns cells = cellsOf(turns, gyro, camera);
  if (cells.empty()) return std::nullopt;
  const std::int64_t centre = (cells.front().from + cells.back().to) / 2;
  const std::int64_t given = std::llround(camera.time_offset_s / kStep_s);
  const auto half = static_cast<double>(cells.back().to - centre);
  const auto most_rates = std::min(kMost, static_cast<std::int64_t>(kMostRate * half)) / kStep;
  double best = 1.0, straight = 1.0, rate = 0.0;
  for (std::int64_t k = -most_rates; k <= most_rates; ++k) {
    ClockLine line{.centre = centre, .rate = static_cast<double>(kStep * k) / half};
    for (line.shift = given - kMost; line.shift <= given + kMost; line.shift += kStep) {
      const double left = unexplainedAt(cells, gyro, line);
      if (k == 0) straight = std::min(straight, left);
      if (left < best) best = left, rate = line.rate;
    }
  }
  if (best > kMostLeft || kTimesLeft * best > straight) return std::nullopt;
  return rate;
}

replay::DataFindings rateFinding(double rate, const CameraCalibration& camera) {
  return {
      {DataFinding::Grade::kCause, "clock_rate",
       fmt::format("the clock of {} runs {:.2g} % too {} for that of the IMU by their turning: "
                   "see which of them has stamps that are counted or computed by a wrong "
                   "rate; if the images, multiply their times since the first by about {:.4f}",
                   camera.name, 100.0 * std::abs(rate), rate < 0.0 ? "fast" : "slow", 1.0 + rate)}};
}

namespace {

/// A shift of over a second, rounded to whole seconds if it has a known cause such as leap seconds.
std::optional<double> longShift(const std::vector<Turn>& along, const Recording& recording) {
  constexpr double kLeast_s = 1.0;
  const CameraCalibration& camera = recording.calibration.cameras.front();
  auto shift = shiftOfTurns(along, recording.imu, camera);
  if (!shift) return std::nullopt;
  *shift -= camera.time_offset_s;
  if (std::abs(*shift) < kLeast_s) return std::nullopt;
  return replay::causeOfShift(*shift).empty() ? *shift : std::round(*shift);
}

}  // namespace

std::optional<double> shiftOfClocks(const Recording& recording) {
  if (recording.calibration.cameras.empty()) return std::nullopt;
  return longShift(turnsAlong(recording), recording);
}

bool areBackwards(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
                  const CameraCalibration& camera, TimePoint first, TimePoint last) {
  constexpr double kNear_s = 0.3;
  std::vector<Turn> backwards;
  for (auto turn = turns.rbegin(); turn != turns.rend(); ++turn) {
    backwards.push_back({last - (turn->to - first), last - (turn->from - first), -turn->of_images});
  }
  const auto shift = shiftOfTurns(backwards, samples, camera);
  return shift && std::abs(*shift) < kNear_s;
}

replay::DataFindings checkClockLine(const Recording& recording, std::vector<PartOffset> parts,
                                    KnownTurns& known) {
  const CameraCalibration& camera = recording.calibration.cameras.front();
  const auto along = turnsAlong(recording, &known);
  if (const auto shift = longShift(along, recording)) return shiftFinding(*shift, camera);
  for (const PartOffset& part : offsetsOfParts(along, recording.imu, camera)) parts.push_back(part);
  if (auto found = judgeParts(std::move(parts), recording); !found.empty()) return found;
  if (const auto rate = rateOfTurns(along, recording.imu, camera))
    return rateFinding(*rate, camera);
  return {};
}

replay::DataFindings checkBackwards(const Recording& recording, KnownTurns& known) {
  const CameraCalibration& camera = recording.calibration.cameras.front();
  if (!areBackwards(turnsAlong(recording, &known), recording.imu, camera,
                    recording.frames.front().time, recording.frames.back().time))
    return {};
  return {{DataFinding::Grade::kFatal, "images_backwards",
           fmt::format("the images of {} turn as the gyroscope says if they are played backwards: "
                       "they are listed in reverse order; reverse the column of their names",
                       camera.name)}};
}

replay::DataFindings shiftFinding(double shift_s, const CameraCalibration& camera) {
  return {{DataFinding::Grade::kFatal, "clock_shift",
           fmt::format("the clock of {} is {:.10g} s {} that of the IMU by their turning{}: {} as "
                       "much {} the stamps of the images, or let perdure doctor --data DRIVE --fix "
                       "COPY do it",
                       camera.name, std::abs(shift_s), shift_s < 0 ? "ahead of" : "behind",
                       replay::causeOfShift(shift_s), shift_s < 0 ? "subtract" : "add",
                       shift_s < 0 ? "from" : "to")}};
}

void shiftImages(double shift_s, Recording& recording) {
  for (auto& frame : recording.frames) frame.time += durationFromSeconds(shift_s);
}

}  // namespace perdure::tools
