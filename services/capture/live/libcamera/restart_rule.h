// Decides when running cameras are briefly closed, so that libcamera enumerates all cameras again.
#pragma once

#include <cstddef>
#include <filesystem>
#include <set>
#include <string>

namespace perdure::capture {

/// libcamera detects plugged-in cameras itself, except those that appear before udev has granted
/// access to their nodes. The number of libcamera's enumerations doubles with each device that is
/// plugged in.
class RestartRule {
 public:
  /// Reports that libcamera enumerated the cameras while these nodes existed.
  void started(std::set<std::string> nodes);
  void unplugged() { ++unplugged_; }
  /// Reports that a camera is missing while libcamera runs and these nodes exist. Returns whether
  /// libcamera should enumerate again; returns true only once for the same nodes.
  bool missed(const std::set<std::string>& nodes);

 private:
  std::set<std::string> known_;
  std::size_t misses_ = 0, unplugged_ = 0;
};

/// Returns the video nodes that this user may open. A node that was removed and created again
/// counts as another node.
std::set<std::string> readableVideoNodes(const std::filesystem::path& folder = "/dev");

}  // namespace perdure::capture
