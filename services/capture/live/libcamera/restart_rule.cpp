#include "services/capture/live/libcamera/restart_rule.h"

#include <sys/stat.h>
#include <unistd.h>

#include <system_error>
#include <utility>

namespace perdure::capture {
namespace {

constexpr std::size_t kMisses = 4;  // two seconds of failed attempts
constexpr std::size_t kMostUnplugged = 5;

}  // namespace

void RestartRule::started(std::set<std::string> nodes) {
  known_ = std::move(nodes);
  misses_ = unplugged_ = 0;
}

bool RestartRule::missed(const std::set<std::string>& nodes) {
  const bool more = !std::ranges::includes(known_, nodes);
  misses_ = more ? misses_ + 1 : 0;
  if (misses_ < kMisses && unplugged_ < kMostUnplugged) return false;
  started(nodes);
  return true;
}

std::set<std::string> readableVideoNodes(const std::filesystem::path& folder) {
  std::set<std::string> nodes;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
    const std::string path = entry.path().string();
    struct stat about {};
    if (!entry.path().filename().string().starts_with("video")) continue;
    if (access(path.c_str(), R_OK | W_OK) != 0 || stat(path.c_str(), &about) != 0) continue;
    nodes.insert(path + " " + std::to_string(about.st_ino));
  }
  return nodes;
}

}  // namespace perdure::capture
