#include "common/base/files/access.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <sstream>

namespace perdure {
namespace {

namespace fs = std::filesystem;

bool denied(const fs::path& path, int mode) {
  return faccessat(AT_FDCWD, path.c_str(), mode, AT_EACCESS) != 0 && errno == EACCES;
}

std::string userOf(uid_t id) {
  const passwd* user = getpwuid(id);
  return user == nullptr ? fmt::format("user {}", id) : user->pw_name;
}

}  // namespace

std::string textOf(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string whyUnreadable(const fs::path& file) {
  if (file.empty()) return {};
  fs::path place;
  for (const fs::path& part : fs::absolute(file)) {
    place /= part;
    struct stat status {};
    if (stat(place.c_str(), &status) != 0) return {};
    const bool folder = S_ISDIR(status.st_mode);
    const bool last = place == fs::absolute(file);
    if (!denied(place, folder ? (last ? R_OK | X_OK : X_OK) : R_OK)) continue;
    return fmt::format(
        "{} may not be read by {}: permission denied; it belongs to {} (mode {:o}). Let this user "
        "read it (chmod a+r{}, setfacl), or run as its owner",
        place.string(), userOf(geteuid()), userOf(status.st_uid), status.st_mode & 07777,
        folder ? "x" : "");
  }
  return {};
}

std::string whyUnreadableIn(const fs::path& folder) {
  std::string why = whyUnreadable(folder);
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder, error), end; why.empty() && !error && at != end;
       at.increment(error)) {
    why = whyUnreadable(at->path());
  }
  return why;
}

}  // namespace perdure
