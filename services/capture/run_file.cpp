#include "services/capture/run_file.h"

#include <filesystem>
#include <fstream>

#include "common/base/files/access.h"
#include "common/base/ids.h"

namespace perdure::capture {

std::string driveOf(const Config& config) {
  std::error_code error;
  const auto path = std::filesystem::weakly_canonical(config.dataset.path, error);
  return toHex(digest(path.string() + "\n" + config.dataset.sequence + "\n" + config.pace.mode +
                      "\n" + std::to_string(config.pace.rate)));
}

std::string bootId() {
  std::string id = textOf("/proc/sys/kernel/random/boot_id");
  while (!id.empty() && id.back() == '\n') id.pop_back();
  return id.empty() ? "unknown" : id;
}

std::optional<RunState> readRunState(const Config& config) {
  if (config.run.state.empty()) return std::nullopt;
  auto state = runStateFrom(textOf(config.run.state));
  if (!state || state->drive != driveOf(config) || state->boot != bootId()) return std::nullopt;
  return state;
}

bool writeRunState(const std::string& file, const RunState& state) {
  const std::string unfinished = file + ".new";
  {
    std::ofstream out(unfinished, std::ios::binary | std::ios::trunc);
    out << toText(state);
    if (!out.flush()) return false;
  }
  std::error_code error;
  std::filesystem::rename(unfinished, file, error);
  return !error;
}

}  // namespace perdure::capture
