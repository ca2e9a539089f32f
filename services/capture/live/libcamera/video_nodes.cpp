#include "services/capture/live/libcamera/video_nodes.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace perdure::capture {
namespace {

/// Returns the descriptors of open video nodes, and the targets of their links.
std::vector<std::pair<int, std::string>> openVideoNodes(const std::filesystem::path& descriptors) {
  std::vector<std::pair<int, std::string>> nodes;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(descriptors, none)) {
    std::string target = std::filesystem::read_symlink(entry.path(), none).string();
    if (!target.starts_with("/dev/video")) continue;
    nodes.emplace_back(std::atoi(entry.path().filename().c_str()), std::move(target));
  }
  return nodes;
}

bool hasBuffers(int node) {
  for (const v4l2_buf_type type :
       {V4L2_BUF_TYPE_VIDEO_CAPTURE, V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE}) {
    v4l2_plane planes[VIDEO_MAX_PLANES] = {};
    v4l2_buffer first{};
    first.type = type;
    if (type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE) {
      first.length = VIDEO_MAX_PLANES;
      first.m.planes = planes;
    }
    if (ioctl(node, VIDIOC_QUERYBUF, &first) == 0) return true;
  }
  return false;
}

}  // namespace

bool openVideoNodeVanished(const std::filesystem::path& descriptors) {
  const auto nodes = openVideoNodes(descriptors);
  return std::ranges::any_of(nodes, [](const auto& node) {
    v4l2_capability unused{};
    return node.second.ends_with(" (deleted)") ||
           (ioctl(node.first, VIDIOC_QUERYCAP, &unused) != 0 && errno == ENODEV);
  });
}

std::set<int> videoNodesWithBuffers(const std::filesystem::path& descriptors) {
  std::set<int> result;
  for (const auto& [node, target] : openVideoNodes(descriptors)) {
    if (hasBuffers(node)) result.insert(node);
  }
  return result;
}

void takeAway(int descriptor) {
  const int silent = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (silent < 0) return;
  dup3(silent, descriptor, O_CLOEXEC);
  close(silent);
}

}  // namespace perdure::capture
