#include "tools/outputs/box_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <utility>
#include <vector>

#include "common/base/algorithms/median.h"
#include "common/camera/camera_model.h"
#include "tools/outputs/box_order.h"
#include "tools/outputs/boxes/box_correction.h"

namespace perdure::tools {
namespace {

using Frames = FrameGlances;

/// The correction of a possible error.
struct Change {
  Doubt doubt;
  BoxChange change;
};

BoxChange changeOf(const Eigen::Vector4d& rows, const Eigen::Vector2d& b = {0, 0}) {
  return {Eigen::Matrix2d{{rows[0], rows[1]}, {rows[2], rows[3]}}, b};
}

Change scaled(double x, double y, const std::string& more = {}) {
  return {{"boxes are of images of another size",
           fmt::format("multiply x1, x2 by {:.4g} and y1, y2 by {:.4g}{}", x, y, more)},
          changeOf({x, 0, 0, y})};
}

std::vector<Change> changesOfPixels(const CameraModel& camera, const Box& all) {
  const double W = camera.width(), H = camera.height();
  const std::string x = fmt::format("x1 = {:.0f} - x2, x2 = {:.0f} - x1", W, W);
  const std::string y = fmt::format("y1 = {:.0f} - y2, y2 = {:.0f} - y1", H, H);
  const char* percent = std::max(all.x2, all.y2) < 101.0 ? " (percent of the image?)" : "";
  const double s = all.x2 / W, above = all.y2 / s - H;
  constexpr double kSame = 0.02;
  const bool margin = std::abs(above) > kSame * H && std::abs(s - 1.0) > kSame;
  std::vector<Change> changes{
      {{"boxes are mirrored left to right", "write " + x}, changeOf({-1, 0, 0, 1}, {W, 0})},
      {{"boxes count y from the lower border", "write " + y}, changeOf({1, 0, 0, -1}, {0, H})},
      {{"boxes are turned by 180°", "write " + x + ", " + y}, changeOf({-1, 0, 0, -1}, {W, H})},
      {{"x and y of the boxes are exchanged", "write x in the columns of y"},
       changeOf({0, 1, 1, 0})},
      {{"boxes are of images turned by 90°",
        fmt::format("write x1 = y1, x2 = y2, y1 = {0:.0f} - x2, y2 = {0:.0f} - x1", H)},
       changeOf({0, 1, -1, 0}, {0, H})},
      {{"boxes are of images turned by 90°",
        fmt::format("write x1 = {0:.0f} - y2, x2 = {0:.0f} - y1, y1 = x1, y2 = x2", W)},
       changeOf({0, -1, 1, 0}, {W, 0})},
      {{"boxes are shifted (crop or margin)",
        fmt::format("add {:.0f} to x1 and x2, {:.0f} to y1 and y2", W - all.x2, H - all.y2)},
       changeOf({1, 0, 0, 1}, {W - all.x2, H - all.y2})},
      scaled(W / all.x2, H / all.y2, percent)};
  if (margin) {
    changes.push_back(
        {{"boxes are of scaled images with a margin",
          fmt::format("divide by {:.4g}, then subtract {:.0f} from y1 and y2", s, above)},
         changeOf({1 / s, 0, 0, 1 / s}, {0, -above})});
  }
  return changes;
}

constexpr char kWrongNumbers[] = "boxes have wrong frame numbers";

/// Changes of frame numbers that do not exceed those of the drive.
std::vector<Change> changesOfNumbers(const Frames& frames) {
  std::uint64_t last = 0, last_boxes = 0;
  for (const auto& [number, frame] : frames) {
    last = number;
    if (!frame.detections.empty()) last_boxes = number;
  }
  std::vector<Change> changes;
  for (const std::uint64_t times : {2, 3, 4, 5, 10}) {
    if (times * last_boxes > last + times) break;
    const std::string fix = fmt::format(
        "the detector saw one frame in {} and counted these; multiply the numbers by {}", times,
        times);
    changes.push_back(
        {.doubt = {kWrongNumbers, fix}, .change = {.times = static_cast<std::int64_t>(times)}});
  }
  const auto isMultiple = [&](std::int64_t per) {
    return std::ranges::all_of(frames, [&](const auto& entry) {
      return entry.second.detections.empty() || static_cast<std::int64_t>(entry.first) % per == 0;
    });
  };
  for (const std::int64_t per : {2, 3}) {
    if (!isMultiple(per)) continue;
    const std::string fix = fmt::format("each number was multiplied by {0}; divide by {0}", per);
    changes.push_back({.doubt = {kWrongNumbers, fix}, .change = {.per = per}});
  }
  for (const std::int64_t by : {-20, -10, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 10, 20}) {
    const std::string fix = fmt::format("{} about {} {} the numbers", by > 0 ? "add" : "subtract",
                                        std::abs(by), by > 0 ? "to" : "from");
    changes.push_back({.doubt = {kWrongNumbers, fix}, .change = {.shift = by}});
  }
  changes.push_back(
      {.doubt = {kWrongNumbers, fmt::format("the frames are in reverse order: write {} - "
                                            "number",
                                            last)},
       .change = {.times = -1, .shift = static_cast<std::int64_t>(last)}});
  return changes;
}

/// A change that makes the boxes agree with the poses.
struct Fit {
  double residual = 0.0;  ///< median, in sizes of the boxes
  Change change;
};

/// A track with its residual as given.
struct Given {
  const BoxTrack* track = nullptr;
  double residual = 0.0;
};
using Givens = std::vector<Given>;

/// Some of the tracks, those whose frames have poses, in the order of time.
Givens givenOf(const std::vector<BoxTrack>& tracks, const Frames& frames,
               const CameraModel& camera) {
  constexpr std::size_t kMost = 300;
  Givens given;
  for (std::size_t i = 0; i < tracks.size(); i += 1 + tracks.size() / kMost) {
    const auto off = deviationsOf(tracks[i], {}, frames, camera);
    if (off) given.push_back({&tracks[i], residualOf(*off)});
  }
  return given;
}

/// Returns nothing if the change does not improve most tracks, and reduce the residual to `most` of
/// that as given.
std::optional<Fit> fitOf(const Change& change, const Givens& all, const Frames& frames,
                         const CameraModel& camera, double most = 0.7) {
  constexpr std::size_t kLeast = 10;
  constexpr double kClearly = 0.7;  // least share of the tracks
  constexpr double kMoving = 0.3;   // residual of objects that move
  std::vector<double> as_given, changed;
  double better = 0.0;
  for (const Given& given : all) {
    const auto off = deviationsOf(*given.track, change.change, frames, camera);
    if (!off) continue;
    as_given.push_back(given.residual), changed.push_back(residualOf(*off));
    better += changed.back() < given.residual ? 1.0 : 0.0;
  }
  const auto tracks = static_cast<double>(changed.size());
  const double now = medianOf(changed), before = medianOf(as_given);
  if (changed.size() < kLeast || now > std::min(kMoving, most * before) ||
      better < kClearly * tracks)
    return std::nullopt;
  const std::string of_given = before < kWorstDeviation ? fmt::format("of {:.1f} %", 100.0 * before)
                                                        : "of views that no point explains";
  const std::string fix = fmt::format(
      "{} tracks of boxes then move as the poses predict, with deviations of {:.1f} % of their "
      "size instead {}: {}",
      changed.size(), 100.0 * now, of_given, change.doubt.fix);
  return Fit{now, {{change.doubt.what, fix}, change.change}};
}

/// The best of the changes, with the others that fit equally well.
std::optional<Fit> bestOf(const std::vector<Change>& changes, const Givens& given,
                          const Frames& frames, const CameraModel& camera) {
  constexpr double kEqual = 1.1;  // ratio of residuals that do not distinguish two changes
  std::vector<Fit> fits;
  for (const Change& change : changes) {
    if (auto fit = fitOf(change, given, frames, camera)) fits.push_back(*std::move(fit));
  }
  if (fits.empty()) return std::nullopt;
  Fit best = *std::ranges::min_element(fits, {}, &Fit::residual);
  const auto [least, first] = best;
  for (const Fit& fit : fits) {
    if (fit.change.doubt.what != first.doubt.what && fit.residual < kEqual * least)
      best.change.doubt.fix += "; or, with equal evidence, " + fit.change.doubt.what;
  }
  return best;
}

std::string axisText(const char* axis, double scale, double sigma, double shift_px,
                     double shift_sigma_px) {
  std::string text;
  if (sigma > 0.0)
    text += fmt::format("multiply {0}1 and {0}2 by {1:.3g} (± {2:.2g})", axis, scale, sigma);
  if (shift_sigma_px > 0.0) {
    text += fmt::format("{0}add {1:.0f} (± {2:.1g}) px to {3}1 and {3}2",
                        text.empty() ? "" : ", then ", shift_px, shift_sigma_px, axis);
  }
  return text;
}

/// The estimated scale and shift of the boxes, if they are clearly wrong.
std::optional<Fit> estimated(const Givens& given, const Frames& frames, const CameraModel& camera) {
  std::vector<const BoxTrack*> tracks;
  for (const Given& one : given) tracks.push_back(one.track);
  const auto found = correctionOf(tracks, frames, camera);
  if (!found) return std::nullopt;
  const auto of = [&](const char* axis, int i) {
    return axisText(axis, found->scale[i], found->scale_sigma[i], found->shift_px[i],
                    found->shift_sigma_px[i]);
  };
  const std::string x = of("x", 0), y = of("y", 1);
  const char* what = found->scale_sigma.isZero()      ? "boxes are shifted"
                     : found->shift_sigma_px.isZero() ? "boxes are of images of another size"
                                                      : "boxes are of scaled and shifted images";
  constexpr double kMost = 0.93;
  const Change change{{what, x + (x.empty() || y.empty() ? "" : "; ") + y}, found->change()};
  return fitOf(change, given, frames, camera, kMost);
}

/// The change that makes the boxes agree with the poses.
std::optional<Change> changeIn(const Givens& given, const std::vector<Change>& changes,
                               const Frames& frames, const CameraModel& camera) {
  constexpr double kClearly = 0.8;  // an estimate explains a little more than an exact change
  auto best = bestOf(changes, given, frames, camera);
  const auto other = estimated(given, frames, camera);
  if (other && (!best || other->residual < kClearly * best->residual)) best = other;
  return best ? std::optional(best->change) : std::nullopt;
}

/// Returns a change of one part of the drive only, with the frame that separates the parts.
std::optional<Change> changeInPart(const Givens& given, const std::vector<Change>& changes,
                                   const Frames& frames, const CameraModel& camera) {
  constexpr std::size_t kLeast = 20;
  if (given.size() < 2 * kLeast) return std::nullopt;
  const auto middle = given.begin() + static_cast<std::ptrdiff_t>(given.size() / 2);
  const auto first = changeIn(Givens(given.begin(), middle), changes, frames, camera),
             second = changeIn(Givens(middle, given.end()), changes, frames, camera);
  if (first.has_value() == second.has_value()) return std::nullopt;
  Change change = first ? *first : *second;
  // The sum of the improvements has its largest or smallest value at the frame of the change.
  double sum = 0.0, most = 0.0;
  std::uint64_t frame = given.front().track->front().frame;
  for (const Given& one : given) {
    const auto off = deviationsOf(*one.track, change.change, frames, camera);
    const double better = off ? std::min(1.0, one.residual) - std::min(1.0, residualOf(*off)) : 0.0;
    sum += first ? better : -better;
    if (sum > most) most = sum, frame = one.track->back().frame;
  }
  change.doubt.what += fmt::format(" {} about frame {}", first ? "up to" : "from", frame);
  return change;
}

/// A doubt if most tracks contradict the poses of their frames, and agree no better with these than
/// with the poses of frames half a drive away.
std::optional<Doubt> doubtOfDrive(const Givens& all, const Frames& frames,
                                  const CameraModel& camera) {
  constexpr std::size_t kLeast = 20;
  constexpr double kMoving = 0.3, kNoBetter = 0.6;
  if (all.size() < kLeast) return std::nullopt;
  const auto half = static_cast<std::int64_t>(frames.rbegin()->first / 2);
  std::vector<double> residuals;
  double better = 0.0;
  for (const Given& given : all) {
    const bool early = static_cast<std::int64_t>(given.track->front().frame) < half;
    const auto off = deviationsOf(*given.track, {.shift = early ? half : -half}, frames, camera);
    if (!off) continue;
    residuals.push_back(given.residual);
    const double other = residualOf(*off);
    better += given.residual < other ? 1.0 : given.residual > other ? 0.0 : 0.5;
  }
  const auto tracks = static_cast<double>(residuals.size());
  if (residuals.size() < kLeast || better > kNoBetter * tracks ||
      medianOf(std::move(residuals)) < kMoving)
    return std::nullopt;
  return Doubt{"boxes contradict the poses",
               fmt::format("{:.0f} tracks of boxes do not move as the poses predict, and move no "
                           "better with their own frames' poses than with others: the boxes are "
                           "of another drive or camera, or the poses are",
                           tracks)};
}

}  // namespace

std::optional<Doubt> doubtOfBoxes(const Frames& frames, const CameraCalibration& calibration) {
  const CameraModel camera(calibration);
  const auto tracks = tracksOf(frames);
  if (auto doubt = doubtOfOrder(frames)) return doubt;
  if (auto doubt = doubtOfClasses(tracks)) return doubt;
  const auto given = givenOf(tracks, frames, camera);
  std::vector<Change> changes = changesOfPixels(camera, extentOf(frames));
  std::ranges::move(changesOfNumbers(frames), std::back_inserter(changes));
  auto change = changeIn(given, changes, frames, camera);
  if (!change) change = changeInPart(given, changes, frames, camera);
  return change ? std::optional(change->doubt) : doubtOfDrive(given, frames, camera);
}

}  // namespace perdure::tools
