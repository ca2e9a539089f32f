#include "services/map_store/core/draft_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <system_error>

namespace perdure::map_store {

DraftFile::DraftFile(const std::string& path) : path_(path + ".part") { remove(); }

void DraftFile::remove() const {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
  for (const char* suffix : kBeside) std::filesystem::remove(path_ + suffix, ignored);
}

bool sync(const std::filesystem::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool synced = fsync(file) == 0;
  close(file);
  return synced;
}

}  // namespace perdure::map_store
