// When the cameras that run are closed for a moment, so that libcamera looks for all of them anew.
#pragma once

#include <cstddef>
#include <filesystem>
#include <set>
#include <string>

namespace perdure::capture {

/// libcamera finds what is plugged in by itself, but not what came before udev had let this user
/// have its nodes; and it looks twice as often at each device that is plugged in.
class RestartRule {
 public:
  /// libcamera looked for cameras when these nodes were there.
  void started(std::set<std::string> nodes);
  void unplugged() { ++unplugged_; }
  /// A camera is missing though libcamera runs, and these nodes are there: whether it is to look
  /// anew. Once for the same nodes.
  bool missed(const std::set<std::string>& nodes);

 private:
  std::set<std::string> known_;
  std::size_t misses_ = 0, unplugged_ = 0;
};

/// The video nodes that this user may open. One that went and came again is another one.
std::set<std::string> readableVideoNodes(const std::filesystem::path& folder = "/dev");

}  // namespace perdure::capture
