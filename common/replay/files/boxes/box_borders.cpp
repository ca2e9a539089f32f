// Judges boxes by the borders of the images: shares, other sizes, exchanged columns.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/errors.h"
#include "common/replay/files/boxes/detection_file.h"

namespace perdure::replay {

/// Refuses boxes whose sides are shares or percent of the image, and boxes without any score.
void DetectionFile::refuseShares() const {
  constexpr double kMost = 1.5;  // shares above 1 belong to boxes that extend beyond the image
  constexpr double kPercent = 101.0, kLeastPercent = 90.0, kLeastSide = 200.0;
  constexpr std::size_t kLeastRows = 20;
  double right = 0.0, bottom = 0.0, score = 0.0;
  for (const auto& [frame, rows] : rows_) {
    for (const Row& row : rows) {
      right = std::max(right, row.detection.box.x2),
      bottom = std::max(bottom, row.detection.box.y2);
      score = std::max(score, row.score);
    }
  }
  if (rows_.empty()) return;
  if (score == 0.0 && logit_classes_.empty()) {
    throw StartupError(ExitCode::kData,
                       "{}: all scores are 0, which means that no box shows an object; write the "
                       "network's scores, or 0.9 if it gives none",
                       options_.file.c_str());
  }
  const bool percent = std::max(right, bottom) < kPercent &&
                       std::min(right, bottom) > kLeastPercent && rows() >= kLeastRows &&
                       std::min(options_.width, options_.height) > kLeastSide;
  if (std::max(right, bottom) + options_.box_origin > kMost && !percent) return;
  throw StartupError(ExitCode::kData,
                     "{}: no side of a box is beyond {} px, so the numbers are {} of the image; "
                     "multiply x1, x2 by its width and y1, y2 by its height{}",
                     options_.file.c_str(), std::max(right, bottom) + options_.box_origin,
                     percent ? "percent" : "shares", percent ? ", and divide by 100" : "");
}

std::string DetectionFile::whyOutside() const {
  constexpr double kThousandth = 1000.0;
  double right = 0.0, bottom = 0.0;
  std::size_t outside = 0;
  for (const auto& [frame, rows] : rows_) {
    for (const Row& row : rows) {
      const Box& box = row.detection.box;
      right = std::max(right, box.x2), bottom = std::max(bottom, box.y2);
      const double x = 0.5 * (box.x1 + box.x2), y = 0.5 * (box.y1 + box.y2);
      outside += x < 0.0 || y < 0.0 || x > options_.width || y > options_.height ? 1 : 0;
    }
  }
  if (options_.width == 0.0 || 4 * outside <= rows()) return {};
  if (isExchanged(right, bottom)) return exchanged(right, bottom);
  const bool thousandths = std::max(right, bottom) <= kThousandth;
  return fmt::format(
      "the centres of {} of {} boxes lie outside of the images ({}x{}); boxes reach to {:.0f}, "
      "{:.0f}: they are of images of another size{}; give corners in pixels of these images",
      outside, rows(), options_.width, options_.height, right, bottom,
      thousandths ? ", or thousandths of the image" : "");
}

bool DetectionFile::isExchanged(double right, double bottom) const {
  const double least = 1.02 * std::min(options_.width, options_.height);
  const bool wide = options_.width > options_.height, high = options_.width < options_.height;
  return (wide && right < least && bottom > least) || (high && bottom < least && right > least);
}

std::string DetectionFile::exchanged(double right, double bottom) const {
  return fmt::format(
      "boxes reach to x = {:.0f}, y = {:.0f} in images of {}x{}: x and y are exchanged; "
      "the columns are x1, y1, x2, y2, with x to the right",
      right, bottom, options_.width, options_.height);
}

/// Finds the border at which boxes of other images are cut off: several end exactly there.
std::string DetectionFile::whyCut(double right, double bottom) const {
  constexpr double kSame_px = 0.5, kOther = 0.02;
  constexpr std::size_t kLeast = 5;
  std::set<double> lefts, tops;  // different boxes
  for (const auto& [frame, rows] : rows_) {
    for (const Row& row : rows) {
      if (row.detection.box.x2 > right - kSame_px) lefts.insert(row.detection.box.x1);
      if (row.detection.box.y2 > bottom - kSame_px) tops.insert(row.detection.box.y1);
    }
  }
  const std::size_t at_right = lefts.size(), at_bottom = tops.size();
  const double x = (right + 1.0) / options_.width, y = (bottom + 1.0) / options_.height;
  const bool wide = at_right >= kLeast && x > 1.0 + kOther;
  const bool high = at_bottom >= kLeast && y > 1.0 + kOther;
  const bool smaller = at_right >= kLeast && at_bottom >= kLeast && x < 1.0 - kOther &&
                       y < 1.0 - kOther && std::abs(x - y) < kOther * x;
  if (!wide && !high && !smaller) return {};
  return fmt::format(
      "{} boxes end at x = {:.0f} and {} at y = {:.0f}: these are the borders of other images than "
      "those of {}x{}; scale or shift the boxes back",
      at_right, right, at_bottom, bottom, options_.width, options_.height);
}

std::string DetectionFile::whyBeyond() const {
  constexpr double kReach = 0.02;  // share of the image; boxes of detectors reach out by less
  double right = 0.0, bottom = 0.0;
  std::size_t beyond = 0, before = 0;
  const double across = kReach * options_.width, down = kReach * options_.height;
  for (const auto& [frame, rows] : rows_) {
    for (const Row& row : rows) {
      const Box& box = row.detection.box;
      right = std::max(right, box.x2), bottom = std::max(bottom, box.y2);
      beyond += box.x2 > options_.width + across || box.y2 > options_.height + down ? 1 : 0;
      before += box.x1 < -across || box.y1 < -down ? 1 : 0;
    }
  }
  if (options_.width == 0.0) return {};
  const bool few = 20 * beyond <= rows() || 10 * before > beyond;
  if (!few && isExchanged(right, bottom)) return exchanged(right, bottom);
  if (const std::string cut = whyCut(right, bottom); few || !cut.empty()) return cut;
  return fmt::format(
      "{} of {} boxes reach beyond the right or lower border of the images ({}x{}), to {:.0f}, "
      "{:.0f}, and {} beyond the left or upper one: they may be of images of another size",
      beyond, rows(), options_.width, options_.height, right, bottom, before);
}

bool DetectionFile::hasSizes() const {
  constexpr std::size_t kLeast = 20;
  constexpr double kBorder = 2.0;  // px; boxes that the border cuts off end this close to it
  std::map<std::pair<double, double>, std::set<double>> lefts;
  std::map<std::pair<double, double>, std::size_t> times;
  for (const auto& [frame, rows] : rows_) {
    for (const Row& row : rows) {
      const Box& box = row.detection.box;
      lefts[{box.x2, box.y2}].insert(box.x1);
      ++times[{box.x2, box.y2}];
    }
  }
  return std::any_of(times.begin(), times.end(), [&](const auto& entry) {
    const auto& [corner, count] = entry;
    const bool inside =
        corner.first < options_.width - kBorder && corner.second < options_.height - kBorder;
    return inside && rows() >= kLeast && 10 * count >= 9 * rows() && lefts[corner].size() > 2;
  });
}

}  // namespace perdure::replay
