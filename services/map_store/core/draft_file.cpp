#include "services/map_store/core/draft_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <filesystem>
#include <system_error>

#include "common/base/errors.h"
#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

namespace {

bool sync(const std::filesystem::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool synced = fsync(file) == 0;
  close(file);
  return synced;
}

std::string fixOf(const Reason& reason) {
  if (reason.code == "disk_full") return "free space there, or name a file on another disk.";
  if (reason.code == "io_error") return "look at the disk there, or name a file on another one.";
  return "name a file in a folder that this user may write.";
}

}  // namespace

void cannotWriteMap(const std::string& path, const Reason& reason) {
  throw StartupError(exitCodeOf(reason), "The map " + path + " cannot be written (" + reason.code +
                                             ": " + reason.detail + "); " + fixOf(reason));
}

DraftFile::DraftFile(const std::string& path) : final_(path), path_(path + ".part") { remove(); }

void DraftFile::remove() const {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
  for (const char* suffix : kBeside) std::filesystem::remove(path_ + suffix, ignored);
}

void DraftFile::keep() const {
  if (!sync(path_)) cannotWriteMap(final_, {"io_error", "it cannot be synced"});
  // SQLite would apply the log of a replaced map to this one.
  std::error_code error;
  for (const char* suffix : kBeside) std::filesystem::remove(final_ + suffix, error);
  std::filesystem::rename(path_, final_, error);
  if (error) cannotWriteMap(final_, {"io_error", error.message()});
  (void)sync(std::filesystem::absolute(final_).parent_path());  // ignored, because not all file
                                                                // systems support it
}

}  // namespace perdure::map_store
