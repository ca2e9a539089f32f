#include "services/vio/state_file.h"

#include <filesystem>
#include <fstream>
#include <system_error>

#include "common/base/errors.h"
#include "common/base/files/access.h"

namespace perdure::vio {

namespace fs = std::filesystem;

StateFile::StateFile(const std::string& directory) {
  if (directory.empty()) return;
  std::error_code error;
  fs::create_directories(directory, error);
  if (error || !fs::is_directory(directory)) {
    throw StartupError(ExitCode::kUnavailable, "state.directory " + directory +
                                                   " cannot be made; give a folder that the "
                                                   "service may write");
  }
  path_ = (fs::path(directory) / "vio.state").string();
}

std::optional<std::string> StateFile::read() const {
  if (path_.empty()) return std::nullopt;
  if (!std::ifstream(path_)) return std::nullopt;
  return textOf(path_);
}

Result<void> StateFile::write(const std::string& text) const {
  if (path_.empty() || text.empty()) return {};
  const std::string temporary = path_ + ".new";
  {
    std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
    out << text;
    out.flush();
    if (!out) return fail("state_not_written", path_);
  }
  std::error_code error;
  fs::rename(temporary, path_, error);
  if (error) return fail("state_not_written", path_);
  return {};
}

}  // namespace perdure::vio
