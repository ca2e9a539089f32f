#include "tools/evaluate/object_report.h"

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "tools/evaluate/simulated_truth.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

bool isImage(const fs::path& relative) {
  return relative.parent_path().filename() == "data" &&
         relative.parent_path().parent_path().filename().string().starts_with("cam");
}

void copyButImages(const fs::path& from, const fs::path& to) {
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(from)) {
    const fs::path relative = entry.path().lexically_relative(from);
    if (!entry.is_regular_file() || isImage(relative)) continue;
    fs::create_directories((to / relative).parent_path(), error);
    fs::copy_file(entry.path(), to / relative, fs::copy_options::overwrite_existing, error);
    if (error == std::errc::no_space_on_device) throwUnwritten(to / relative, error.message());
    if (error) {
      throw StartupError(ExitCode::kUnavailable, (to / relative).string() + ": " + error.message() +
                                                     "; give --out a folder that can be written");
    }
  }
}

}  // namespace

nlohmann::ordered_json toReport(const ObjectScore& score) {
  const Cell& at_one_metre = score.cells[1][2];
  return {{"recall", at_one_metre.recall()},
          {"precision", at_one_metre.precision()},
          {"duplicates", score.idsPerFound()},
          {"position_error_m", at_one_metre.positionError()}};
}

nlohmann::ordered_json reportSimulated(const fs::path& folder, const fs::path& out,
                                       const std::optional<std::set<std::uint64_t>>& used) {
  const SimulatedTruth truth = readSimulatedTruth(folder);
  SimulatedRun run = pairWithTruth(truth, readObjectRows(out / "objects_final.csv"),
                                   replay::PoseFile::read(out / "trajectory.tum").poses(), "");
  std::erase_if(run.frames,
                [&](const auto& frame) { return used && !used->contains(frame.first); });
  const ObjectScore score = scoreFrames(run.frames, {.frame_interval_s = truth.frameInterval()});
  auto report = toReport(score);
  report["objects"] = score.objects;
  report["objects_found"] = score.objects_found;
  report["id_switches"] = score.id_switches;
  report["of"] =
      "all classes in objects_final.csv, under 1 m, any orientation; duplicates are "
      "objects of the map for each true one that was found";
  copyButImages(folder, out / "truth");
  return report;
}

}  // namespace perdure::tools
