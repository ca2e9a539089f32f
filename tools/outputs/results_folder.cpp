#include "tools/outputs/results_folder.h"

#include <fmt/format.h>

#include <system_error>
#include <utility>
#include <vector>

#include "common/base/checked_file.h"
#include "common/base/errors.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

bool holdsARun(const fs::path& folder) {
  std::error_code none;
  return fs::exists(folder / "report.json", none) || fs::exists(folder / "map.sqlite", none);
}

void removeAll(const fs::path& path) {
  std::error_code error;
  fs::remove_all(path, error);
  if (!error) return;
  throw StartupError(ExitCode::kUnavailable,
                     "{}: cannot be removed: {}; give --out a folder that you may write",
                     path.string(), error.message());
}

}  // namespace

ResultsFolder::ResultsFolder(fs::path out)
    : out_(std::move(out)), written_(out_), is_new_(!fs::exists(out_)), lock_(out_) {
  removeAll(out_ / "unfinished");
  if (holdsARun(out_)) written_ = out_ / "unfinished";
}

ResultsFolder::~ResultsFolder() {
  std::error_code none;
  if (written_ != out_) fs::remove_all(written_, none);
  if (is_new_) fs::remove(out_, none);  // does nothing if the folder is not empty
}

void ResultsFolder::keep() {
  if (!lock_.holds()) {
    throw StartupError(ExitCode::kInputOutput,
                       "{}: the folder was removed or replaced during the run; run it again",
                       out_.string());
  }
  if (written_ == out_) return;
  std::error_code error;
  std::vector<fs::path> names;
  for (const auto& entry : fs::directory_iterator(written_, error)) {
    names.push_back(entry.path().filename());
  }
  // Removes the journal, because it belongs to the earlier map.
  for (const char* part : {"map.sqlite-wal", "map.sqlite-shm"}) removeAll(out_ / part);
  for (const fs::path& name : names) {
    if (fs::is_directory(out_ / name, error)) removeAll(out_ / name);
    fs::rename(written_ / name, out_ / name, error);
    if (error) throwUnwritten(out_ / name, error.message());
  }
}

}  // namespace perdure::tools
