// The video nodes that libcamera has open in this process, which it does not tell.
#pragma once

#include <filesystem>
#include <set>

namespace perdure::capture {

/// Whether one is there no more. `descriptors`: links to what is open.
bool openVideoNodeVanished(const std::filesystem::path& descriptors = "/proc/self/fd");

/// The descriptors of those that give images into buffers now: a camera has them from when it
/// starts to when it stops.
std::set<int> videoNodesWithBuffers(const std::filesystem::path& descriptors = "/proc/self/fd");

/// Gives the descriptor to a file that never has anything to read and refuses what is asked of a
/// video node. Who has the descriptor still closes it.
void takeAway(int descriptor);

}  // namespace perdure::capture
