// Video nodes that libcamera has open in this process. libcamera has no function that lists them.
#pragma once

#include <filesystem>
#include <set>

namespace perdure::capture {

/// Whether an open video node no longer exists. `descriptors`: folder of links to the open files.
bool openVideoNodeVanished(const std::filesystem::path& descriptors = "/proc/self/fd");

/// Descriptors of the nodes that stream into buffers, between a camera's start and stop.
std::set<int> videoNodesWithBuffers(const std::filesystem::path& descriptors = "/proc/self/fd");

/// Replaces the file of the descriptor by one that never has data and refuses video requests. The
/// owner of the descriptor still closes it.
void takeAway(int descriptor);

}  // namespace perdure::capture
