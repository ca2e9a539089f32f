#include "tools/evaluate/used_frames.h"

#include <algorithm>
#include <fstream>

#include "common/base/errors.h"

namespace perdure::tools {
namespace {

constexpr std::uint64_t kMostFrames = 100'000'000;

struct Run {
  std::uint64_t first = 0, last = 0, step = 1;
};

/// Parses [first, last, step]; empty if it is invalid.
std::optional<Run> runIn(const nlohmann::json& json) {
  if (!json.is_array() || json.size() != 3) return std::nullopt;
  for (const auto& n : json) {
    if (!n.is_number_unsigned() || n.get<std::uint64_t>() > kMostFrames) return std::nullopt;
  }
  const Run run{json[0].get<std::uint64_t>(), json[1].get<std::uint64_t>(),
                json[2].get<std::uint64_t>()};
  if (run.step == 0 || run.last < run.first) return std::nullopt;
  return run;
}

}  // namespace

nlohmann::ordered_json framesToJson(const UsedFrames& frames) {
  std::vector<Run> runs;
  for (const std::uint64_t frame : frames) {
    const bool begins = !runs.empty() && runs.back().first == runs.back().last;
    if (begins) runs.back().step = frame - runs.back().first;
    if (runs.empty() || frame != runs.back().last + runs.back().step) {
      runs.push_back({frame, frame, 1});
    } else {
      runs.back().last = frame;
    }
  }
  nlohmann::ordered_json json = {{"used", frames.size()},
                                 {"runs", nlohmann::ordered_json::array()}};
  for (const Run& run : runs) json["runs"].push_back({run.first, run.last, run.step});
  return json;
}

std::optional<UsedFrames> usedFramesOf(const std::filesystem::path& run) {
  const auto file = run / "report.json";
  std::ifstream in(file);
  if (!in) return std::nullopt;
  const auto report = nlohmann::json::parse(in, nullptr, false);
  if (!report.is_object() || !report.contains("frames")) return std::nullopt;
  const auto& frames = report["frames"];
  UsedFrames used;
  bool whole = frames.is_object() && frames.contains("runs") && frames["runs"].is_array();
  for (const auto& json : whole ? frames["runs"] : nlohmann::json::array()) {
    const auto one = runIn(json);
    whole = whole && one;
    if (!whole) break;
    for (std::uint64_t f = one->first; f <= one->last; f += one->step) used.insert(f);
  }
  if (whole) return used;
  throw StartupError(ExitCode::kData, file.string() +
                                          ": `frames` does not say which frames the run was over; "
                                          "run perdure pipeline again, or take the file away");
}

std::size_t withoutPose(const std::vector<TimePoint>& frames,
                        const std::vector<replay::StampedPose>& poses) {
  constexpr Duration kSame = std::chrono::milliseconds(1);
  if (poses.empty()) return 0;
  const auto unposed = [&](TimePoint frame) {
    if (frame < poses.front().time || frame > poses.back().time) return false;
    const auto at = std::ranges::lower_bound(poses, frame - kSame, {}, &replay::StampedPose::time);
    return at == poses.end() || at->time - frame > kSame;
  };
  return static_cast<std::size_t>(std::ranges::count_if(frames, unposed));
}

std::string noteOfUntold(std::size_t frames) {
  return "note: " + std::to_string(frames) +
         " frames between poses have none and count as missed; a run with --every leaves frames "
         "out, and the report.json that tells which is not beside the trajectory";
}

double strideOf(const UsedFrames& frames) {
  if (frames.size() < 2) return 1.0;
  return static_cast<double>(*frames.rbegin() - *frames.begin()) /
         static_cast<double>(frames.size() - 1);
}

}  // namespace perdure::tools
