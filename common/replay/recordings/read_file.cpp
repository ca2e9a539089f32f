#include "common/replay/recordings/read_file.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "common/base/files/access.h"

namespace perdure::replay {
namespace {

int openedToRead(const std::filesystem::path& path) {
  return ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
}

}  // namespace

Result<ReadFile> ReadFile::open(const std::filesystem::path& path) {
  ReadFile file;
  file.path_ = path;
  file.file_ = Descriptor(openedToRead(path));
  if (!file.file_.open()) {
    const std::string why_not = path.string() + ": " + std::strerror(errno);
    const std::string forbidden = whyUnreadable(path);
    return fail("file", "{}", forbidden.empty() ? why_not : forbidden);
  }
  struct stat status {};
  if (fstat(file.file_.get(), &status) != 0 || !S_ISREG(status.st_mode)) {
    return fail("file", "{}: not a file", path.c_str());
  }
  file.size_ = static_cast<std::uint64_t>(status.st_size);
  return file;
}

std::vector<std::uint8_t> ReadFile::read(std::uint64_t at, std::uint64_t length) const {
  const Descriptor again(file_.open() ? -1 : openedToRead(path_));
  const int file = file_.open() ? file_.get() : again.get();
  std::vector<std::uint8_t> bytes(at < size_ ? std::min(length, size_ - at) : 0);
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n =
        pread(file, bytes.data() + done, bytes.size() - done, static_cast<off_t>(at + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    done += static_cast<std::size_t>(n);
  }
  bytes.resize(done);
  return bytes;
}

}  // namespace perdure::replay
