#include "tools/data_check/frozen_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>

#include "tools/data_check/motion_in.h"

namespace perdure::tools {
namespace {

using replay::DataFinding;
using replay::Recording;
using FrameFile = Recording::FrameFile;
using Frames = std::vector<const FrameFile*>;

bool areSameFiles(const std::string& a, const std::string& b) {
  std::error_code error;
  const auto size = std::filesystem::file_size(a, error);
  if (error || size == 0 || std::filesystem::file_size(b, error) != size) return false;
  using Bytes = std::istreambuf_iterator<char>;
  std::ifstream first(a, std::ios::binary), second(b, std::ios::binary);
  return first && second && std::equal(Bytes(first), Bytes(), Bytes(second), Bytes());
}

bool areSame(const FrameFile& a, const FrameFile& b) {
  if (!a.load) return areSameFiles(a.path, b.path);
  const auto first = a.load(), second = b.load();
  return first && second && first->data && second->data &&
         std::ranges::equal(*first->data, *second->data);
}

/// The farthest image from `start` in the direction of `step` that is the same.
std::size_t farthestSame(const Frames& frames, std::size_t start, bool later) {
  std::size_t same = 0, other = later ? frames.size() - start : start + 1;
  while (other - same > 1) {
    const std::size_t middle = same + (other - same) / 2;
    const auto& frame = *frames[later ? start + middle : start - middle];
    (areSame(*frames[start], frame) ? same : other) = middle;
  }
  return later ? start + same : start - same;
}

struct Still {
  std::size_t first, last;
};

/// The longest time, over a second, in which an image is repeated.
std::optional<Still> longestStill(const Frames& frames) {
  constexpr Duration kLeast = std::chrono::seconds(1);
  constexpr std::int64_t kPlaces = 400, kPlacesInFile = 30;  // images in a file are slow to reach
  if (frames.size() < 2) return std::nullopt;
  const Duration each = std::max(kLeast / 2, (frames.back()->time - frames.front()->time) /
                                                 (frames.front()->load ? kPlacesInFile : kPlaces));
  std::optional<Still> longest;
  Duration most = kLeast;
  TimePoint next = frames.front()->time;
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
    if (frames[i]->time < next) continue;
    next = frames[i]->time + each;
    if (!areSame(*frames[i], *frames[i + 1])) continue;
    const Still still{farthestSame(frames, i, false), farthestSame(frames, i, true)};
    const Duration lasts = frames[still.last]->time - frames[still.first]->time;
    if (lasts >= most) most = lasts, longest = still;
    i = std::max(i, still.last);
  }
  return longest;
}

/// Flow of the images just before the repeated one; after it if there are few.
double flowBeside(const Recording& recording, const Frames& frames, const Still& still) {
  constexpr std::size_t kFew = 5;
  if (still.first >= kFew) {
    return flowIn(recording, frames[still.first - kFew]->time, frames[still.first]->time);
  }
  const std::size_t last = std::min(still.last + kFew, frames.size() - 1);
  return flowIn(recording, frames[still.last]->time, frames[last]->time);
}

}  // namespace

replay::DataFindings checkFrozenImages(const Recording& recording) {
  constexpr double kTurns_rad = 0.02, kMoves_mps = 0.5, kFlows_px = 0.5;
  Frames frames;
  for (const FrameFile& frame : recording.frames) {
    if (frame.camera == 0 && (frame.load || !frame.path.empty())) frames.push_back(&frame);
  }
  const auto still = longestStill(frames);
  if (!still) return {};
  const TimePoint from = frames[still->first]->time, to = frames[still->last]->time;
  const char* moves = turningIn(recording, from, to) > kTurns_rad         ? "the gyroscope turns"
                      : speedIn(recording, from, to) > kMoves_mps         ? "the body has a speed"
                      : flowBeside(recording, frames, *still) > kFlows_px ? "the camera moves"
                                                                          : nullptr;
  if (!moves) return {};
  return {{DataFinding::Grade::kWarning, "images_frozen",
           fmt::format(
               "{} repeats one image from {} to {} ns ({:.1f} s, images {} to {}) while {}: "
               "the camera, or its driver, stopped; cut the drive there",
               recording.calibration.cameras.front().name, toNanoseconds(from), toNanoseconds(to),
               toSeconds(to - from), still->first + 1, still->last + 1, moves)}};
}

}  // namespace perdure::tools
