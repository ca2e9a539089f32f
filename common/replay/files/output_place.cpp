#include "common/replay/files/output_place.h"

#include <algorithm>
#include <array>

#include "common/base/errors.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

fs::path realOf(const fs::path& path) {
  std::error_code error;
  fs::path real = fs::weakly_canonical(fs::absolute(path), error);
  if (error) real = fs::absolute(path).lexically_normal();
  return real.has_filename() ? real : real.parent_path();
}

constexpr char kRun[] = "run.mcap";

/// Returns whether `name` is a sensor folder in a supported layout.
bool isOfSensors(const std::string& name) {
  constexpr std::array kSensorFolders{"mav0",  "oxts", "calib",   "color",
                                      "depth", "pose", "label_02"};
  return std::find(kSensorFolders.begin(), kSensorFolders.end(), name) != kSensorFolders.end() ||
         name.starts_with("image_0") || name.starts_with("seq-") || name.starts_with("velodyne");
}

}  // namespace

void refuseInside(const fs::path& out, const fs::path& data, const std::string& option) {
  std::error_code error;
  if (!fs::is_directory(data, error)) return;
  const fs::path folder = realOf(data);
  const fs::path below = realOf(out).lexically_relative(folder);
  const std::string first = below.empty() ? ".." : below.begin()->string();
  if (first == "..") return;
  const bool sensors = folder.filename() == "mav0" ||
                       (isOfSensors(first) && fs::is_directory(folder / first, error));
  // A folder with a run's recording may also receive the results of another run.
  const bool of_run = first == "." && fs::is_regular_file(folder / kRun, error);
  if (of_run || (first != "." && !sensors)) return;
  throw StartupError(ExitCode::kUsage, option + " " + out.string() + " lies in the data, " +
                                           data.string() +
                                           ", which stay as they are: give a folder beside them");
}

void refuseOverwriting(const fs::path& written, const fs::path& data, const std::string& option) {
  std::error_code error;
  const fs::path read = fs::is_directory(data, error) ? data / kRun : data;
  if (!fs::equivalent(written, read, error) || error) return;
  throw StartupError(ExitCode::kUsage, option + " would write to " + written.string() +
                                           ", which is the recording that is read: give another "
                                           "folder");
}

}  // namespace perdure::replay
