// Decides when running cameras are briefly closed, so that libcamera enumerates all cameras again.
#pragma once

#include <cstddef>
#include <filesystem>
#include <set>
#include <string>

namespace perdure::capture {

/// libcamera detects plugged-in cameras itself, except those that appear before udev has granted
/// access to their nodes. Its enumerations double with each device that is plugged in.
class RestartRule {
 public:
  /// libcamera enumerated the cameras while these nodes existed.
  void started(std::set<std::string> nodes);
  void unplugged() { ++unplugged_; }
  /// A camera is missing while libcamera runs and these nodes exist. Returns whether libcamera
  /// should enumerate again, once for the same nodes.
  bool missed(const std::set<std::string>& nodes);

 private:
  std::set<std::string> known_;
  std::size_t misses_ = 0, unplugged_ = 0;
};

/// Video nodes that this user may open; a node that was created again is another one.
std::set<std::string> readableVideoNodes(const std::filesystem::path& folder = "/dev");

}  // namespace perdure::capture
