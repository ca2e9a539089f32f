#include "tools/data_check/frozen_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

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

/// The last image that equals image `start`, searched forwards if `later`, else backwards.
std::size_t farthestSame(const Frames& frames, std::size_t start, bool later) {
  std::size_t same = 0, other = later ? frames.size() - start : start + 1;
  while (other - same > 1) {
    const std::size_t middle = same + (other - same) / 2;
    const auto& frame = *frames[later ? start + middle : start - middle];
    (areSame(*frames[start], frame) ? same : other) = middle;
  }
  return later ? start + same : start - same;
}

struct Repeated {
  std::size_t first = 0, last = 0;   ///< images of the longest time in which one is repeated
  std::size_t places = 0, same = 0;  ///< neighbours that were compared, and that are the same
};

Repeated repeatedIn(const Frames& frames) {
  constexpr Duration kEach = std::chrono::milliseconds(250);
  constexpr std::int64_t kPlaces = 400, kPlacesInFile = 60;  // images in a file are slow to read
  Repeated repeated;
  if (frames.size() < 2) return repeated;
  const Duration each =
      std::max<Duration>(kEach, (frames.back()->time - frames.front()->time) /
                                    (frames.front()->load ? kPlacesInFile : kPlaces));
  Duration most{0};
  TimePoint next = frames.front()->time;
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
    if (frames[i]->time < next) continue;
    next = frames[i]->time + each;
    ++repeated.places;
    if (!areSame(*frames[i], *frames[i + 1])) continue;
    ++repeated.same;
    const std::size_t first = farthestSame(frames, i, false), last = farthestSame(frames, i, true);
    const Duration lasts = frames[last]->time - frames[first]->time;
    if (lasts > most) most = lasts, repeated.first = first, repeated.last = last;
    i = std::max(i, last);
  }
  return repeated;
}

/// Whether the images moved before the repeated one, or jump after it.
bool jumps(const Recording& recording, const Frames& frames, const Repeated& still) {
  constexpr double kFlows_px = 0.5, kFarther = 3.0;
  const auto flow = [&](std::size_t i) { return flowOf(recording, *frames[i], *frames[i + 1]); };
  if (still.first > 0 && flow(still.first - 1) > kFlows_px) return true;
  return still.last + 2 < frames.size() &&
         flow(still.last) > kFarther * flow(still.last + 1) + kFlows_px;
}

}  // namespace

replay::DataFindings checkFrozenImages(const Recording& recording) {
  constexpr double kTurns_rad = 0.02, kMoves_mps = 0.5;
  constexpr std::size_t kFewest = 10;
  Frames frames;
  for (const FrameFile& frame : recording.frames) {
    if (frame.camera == 0 && (frame.load || !frame.path.empty())) frames.push_back(&frame);
  }
  constexpr Duration kLeast = std::chrono::milliseconds(500);
  const std::string& camera = recording.calibration.cameras.front().name;
  const Repeated still = repeatedIn(frames);
  if (still.same == 0) return {};
  const TimePoint from = frames[still.first]->time, to = frames[still.last]->time;
  if (to - from < kLeast) {
    if (still.places < kFewest || 5 * still.same < still.places) return {};
    return {{DataFinding::Grade::kWarning, "images_repeated",
             fmt::format("{} of {} images of {} that were compared are the same as the next: its "
                         "driver delivers images more than once; write each once, with its stamp",
                         still.same, still.places, camera)}};
  }
  const char* moves = turningIn(recording, from, to) > kTurns_rad ? "the gyroscope turns"
                      : speedIn(recording, from, to) > kMoves_mps ? "the body has a speed"
                      : jumps(recording, frames, still)           ? "the camera moves"
                                                                  : nullptr;
  if (!moves) return {};
  return {
      {DataFinding::Grade::kWarning, "images_frozen",
       fmt::format("{} repeats one image from {} to {} ns ({:.1f} s, images {} to {}) while {}: "
                   "the camera, or its driver, stopped; cut the drive there",
                   camera, toNanoseconds(from), toNanoseconds(to), toSeconds(to - from),
                   still.first + 1, still.last + 1, moves)}};
}

}  // namespace perdure::tools
