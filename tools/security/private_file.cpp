#include "tools/security/private_file.h"

#include <fcntl.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "common/base/errors.h"

namespace perdure::tools {
namespace {

[[noreturn]] void cannotWrite(const std::filesystem::path& path) {
  throw StartupError(ExitCode::kUnavailable,
                     path.string() + " cannot be written: " + std::strerror(errno));
}

bool writeAll(int file, const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t n = ::write(file, text.data() + done, text.size() - done);
    if (n <= 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return fsync(file) == 0;
}

}  // namespace

Owner ownerNamed(const std::string& user) {
  const passwd* found = getpwnam(user.c_str());
  if (found == nullptr) {
    throw StartupError(ExitCode::kUsage, "there is no user " + user + " on this host");
  }
  return {found->pw_uid, found->pw_gid};
}

void writePrivate(const std::filesystem::path& file, const std::string& text, mode_t mode,
                  const std::optional<Owner>& owner) {
  const std::filesystem::path half = file.string() + ".new";
  unlink(half.c_str());
  const int fd = open(half.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, mode);
  if (fd < 0) cannotWrite(file);
  const bool written = fchmod(fd, mode) == 0 && writeAll(fd, text) &&
                       (!owner || fchown(fd, owner->user, owner->group) == 0);
  close(fd);
  if (!written || rename(half.c_str(), file.c_str()) != 0) cannotWrite(file);
}

void makePrivateFolder(const std::filesystem::path& folder, const std::optional<Owner>& owner) {
  if (mkdir(folder.c_str(), S_IRWXU) != 0 && errno != EEXIST) cannotWrite(folder);
  if (owner && chown(folder.c_str(), owner->user, owner->group) != 0) cannotWrite(folder);
}

}  // namespace perdure::tools
