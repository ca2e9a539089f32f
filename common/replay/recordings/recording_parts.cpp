#include "common/replay/recordings/recording_parts.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/errors.h"

namespace perdure::replay {
namespace {

double secondsBetween(std::uint64_t from_ns, std::uint64_t to_ns) {
  return 1e-9 * (static_cast<double>(to_ns) - static_cast<double>(from_ns));
}

bool shareTopic(const RecordingPart& a, const RecordingPart& b) {
  return std::any_of(a.topics.begin(), a.topics.end(),
                     [&](const std::string& topic) { return b.topics.contains(topic); });
}

/// Returns whether two parts overlap considerably. The parts of one recording follow each other;
/// only a step of the clock makes them overlap slightly.
bool overlap(const RecordingPart& a, const RecordingPart& b) {
  constexpr double kMost = 0.1;  // largest overlap, as a share of the shorter recording
  const double common = secondsBetween(b.start_ns, std::min(a.end_ns, b.end_ns));
  return common > kMost * std::min(secondsBetween(a.start_ns, a.end_ns),
                                   secondsBetween(b.start_ns, b.end_ns));
}

}  // namespace

std::vector<std::string> joinParts(std::vector<RecordingPart> parts) {
  constexpr double kGap_s = 1.0;
  std::vector<std::string> notes;
  std::erase_if(parts, [](const RecordingPart& part) { return part.end_ns <= part.start_ns; });
  std::sort(parts.begin(), parts.end(),
            [](const auto& a, const auto& b) { return a.start_ns < b.start_ns; });
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const RecordingPart& later = parts[i];
    const RecordingPart* before = nullptr;  // the last earlier part that has a topic in common
    for (std::size_t k = 0; k < i; ++k) {
      if (!shareTopic(parts[k], later)) continue;
      if (overlap(parts[k], later)) {
        throw StartupError(
            ExitCode::kData,
            "{} and {} hold the same topics at the same time, so they are two "
            "recordings; give one of the files, or put each into a folder of its own",
            parts[k].file.string(), later.file.filename().string());
      }
      if (before == nullptr || parts[k].end_ns > before->end_ns) before = &parts[k];
    }
    if (before == nullptr || secondsBetween(before->end_ns, later.start_ns) <= kGap_s) continue;
    notes.push_back(fmt::format(
        "{} begins {:.1f} s after the end of {}; the files are read as one recording. If they are "
        "two, give one of them",
        later.file.string(), secondsBetween(before->end_ns, later.start_ns),
        before->file.filename().string()));
  }
  return notes;
}

}  // namespace perdure::replay
