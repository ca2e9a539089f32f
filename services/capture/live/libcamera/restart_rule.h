// Decides when running cameras are briefly closed, so that libcamera enumerates all cameras again.
#pragma once

#include <cstddef>
#include <filesystem>
#include <set>
#include <string>

namespace perdure::capture {

/// libcamera misses cameras that appear before udev grants access to their nodes.
class RestartRule {
 public:
  /// libcamera enumerated the cameras while these nodes existed.
  void started(std::set<std::string> nodes);
  void unplugged() { ++unplugged_; }
  /// A camera is missing while these nodes exist: whether to enumerate again, once for them.
  bool missed(const std::set<std::string>& nodes);

 private:
  std::set<std::string> known_;
  std::size_t misses_ = 0, unplugged_ = 0;
};

/// Video nodes that this user may open; a node that was created again is another one.
std::set<std::string> readableVideoNodes(const std::filesystem::path& folder = "/dev");

}  // namespace perdure::capture
