#include "common/base/files/folder_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "common/base/errors.h"

namespace perdure {

std::string lockerOf(const std::filesystem::path& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return {};
  const std::string inode = fmt::format(":{} ", status.st_ino);
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::string number, kind, advisory, mode, process;
    std::istringstream(line) >> number >> kind >> advisory >> mode >> process;
    if (line.find(inode) != std::string::npos && mode == "WRITE" && process != "0") {
      return " (process " + process + ")";
    }
  }
  return {};
}

FolderLock::FolderLock(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (!std::filesystem::is_directory(folder_)) {
    throw StartupError(ExitCode::kUnavailable, "{}: cannot be made: {}; give --out another folder",
                       folder_.string(), error ? error.message() : "it is a file");
  }
  if (access(folder_.c_str(), W_OK) != 0) {
    throw StartupError(ExitCode::kUnavailable,
                       "{} cannot be written ({}); give --out another folder, or this user the "
                       "right to write",
                       folder_.string(), std::strerror(errno));
  }
  descriptor_ = Descriptor(open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (flock(descriptor_.get(), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  throw StartupError(ExitCode::kUnavailable,
                     "{}: another process{} writes to this folder; give --out another one, or wait "
                     "until that process has ended",
                     folder_.string(), lockerOf(folder_));
}

bool FolderLock::holds() const {
  if (!descriptor_.open()) return true;  // folders that cannot be read are not locked
  struct stat now {
  }, then{};
  return stat(folder_.c_str(), &now) == 0 && fstat(descriptor_.get(), &then) == 0 &&
         now.st_dev == then.st_dev && now.st_ino == then.st_ino;
}

}  // namespace perdure
