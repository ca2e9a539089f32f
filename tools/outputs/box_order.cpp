#include "tools/outputs/box_order.h"

#include <fmt/format.h>

#include <algorithm>

namespace perdure::tools {
namespace {

using FramesWithBoxes = std::vector<const FrameGlance*>;

/// Boxes that overlap one of another frame, of all.
struct Continued {
  std::size_t boxes = 0, overlap = 0;

  void add(const FrameGlance& from, const FrameGlance& to) {
    constexpr double kOverlap = 0.3;
    for (const auto& one : from.detections) {
      ++boxes;
      overlap += std::ranges::any_of(to.detections, [&](const auto& other) {
        return intersectionOverUnion(one.box, other.box) > kOverlap;
      });
    }
  }
  double share() const {
    return static_cast<double>(overlap) / static_cast<double>(std::max<std::size_t>(1, boxes));
  }
};

}  // namespace

std::optional<Doubt> doubtOfOrder(const FrameGlances& frames) {
  constexpr double kLongest_s = 0.15, kFew = 0.5, kNoBetter = 1.3;
  constexpr std::size_t kLeast = 200;
  FramesWithBoxes all;
  for (const auto& [number, frame] : frames) {
    if (!frame.detections.empty()) all.push_back(&frame);
  }
  Continued next, distant;
  for (std::size_t i = 0; i + 1 < all.size(); ++i) {
    if (toSeconds(all[i + 1]->stamp.time - all[i]->stamp.time) > kLongest_s) continue;
    next.add(*all[i], *all[i + 1]);
    distant.add(*all[i], *all[(i + all.size() / 2) % all.size()]);
  }
  if (next.boxes < kLeast || next.share() > kFew || next.share() > kNoBetter * distant.share())
    return std::nullopt;
  return Doubt{"boxes do not continue from frame to frame",
               fmt::format("{:.0f} % of {} boxes overlap one of the next frame, {:.0f} % one of a "
                           "frame far away: the frame numbers are in disorder, or the boxes are "
                           "of other images; write the number of each box's own image",
                           100.0 * next.share(), next.boxes, 100.0 * distant.share())};
}

std::optional<Doubt> doubtOfClasses(const std::vector<BoxTrack>& tracks) {
  constexpr double kMost = 0.6;  // share of the steps; networks change between similar classes
  constexpr std::size_t kLeast = 100;
  std::size_t steps = 0, changes = 0;
  for (const BoxTrack& track : tracks) {
    for (std::size_t i = 1; i < track.size(); ++i) {
      ++steps;
      changes += track[i].best_class != track[i - 1].best_class ? 1 : 0;
    }
  }
  const double share =
      static_cast<double>(changes) / static_cast<double>(std::max<std::size_t>(1, steps));
  if (steps < kLeast || share < kMost) return std::nullopt;
  return Doubt{"classes of the boxes change from frame to frame",
               fmt::format("at {:.0f} % of {} steps, a box has another class than the box that it "
                           "continues: the column of the class belongs to other rows; see how the "
                           "file was written",
                           100.0 * share, steps)};
}

}  // namespace perdure::tools
