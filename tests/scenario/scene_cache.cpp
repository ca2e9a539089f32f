#include "tests/scenario/scene_cache.h"

#include <fcntl.h>
#include <sys/file.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "common/base/ids.h"
#include "common/base/process/descriptor.h"

namespace perdure::test {
namespace {

namespace fs = std::filesystem;

std::string textOf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// Digest of everything that determines a scene.
std::string sourcesDigest() {
  const char* root = std::getenv("PERDURE_SOURCE");
  if (root == nullptr) throw std::runtime_error("PERDURE_SOURCE is not set; use ctest");
  std::vector<fs::path> files;
  for (const char* folder : {"common/sim", "common/math", "common/camera", "tools/simulate"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(root) / folder)) {
      const auto extension = entry.path().extension();
      if (extension == ".cpp" || extension == ".h") files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  std::string all;
  for (const auto& file : files) all += toHex(digest(textOf(file)));
  return toHex(digest(all));
}

/// Programs are one folder below the build folder.
fs::path cacheFolder() {
  const fs::path build = fs::read_symlink("/proc/self/exe").parent_path().parent_path();
  const fs::path all = build / "tests" / "scenes", own = all / sourcesDigest();
  std::error_code ignored;
  if (fs::create_directories(own, ignored)) {
    for (const auto& entry : fs::directory_iterator(all)) {
      if (entry.path() != own) fs::remove_all(entry.path(), ignored);
    }
  }
  return own;
}

}  // namespace

fs::path cachedScene(const SceneName& name, const std::function<void(const fs::path&)>& make) {
  const fs::path folder = cacheFolder() / (name.scene + "-" + std::to_string(name.seed) + "-" +
                                           std::to_string(static_cast<int>(name.seconds)) + "-" +
                                           std::to_string(static_cast<int>(name.rate_hz)) +
                                           (name.images ? "-images" : ""));
  const std::string file = folder.string() + ".lock";
  const Descriptor lock(open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (!lock.open() || flock(lock.get(), LOCK_EX) != 0) {
    throw std::runtime_error(file + " cannot be locked: " + std::strerror(errno));
  }
  make(folder);
  return folder;
}

}  // namespace perdure::test
