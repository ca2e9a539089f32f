// Finds the video nodes that libcamera has opened in this process, because libcamera has no
// function for this.
#pragma once

#include <filesystem>
#include <set>

namespace perdure::capture {

/// Returns whether an open video node does not exist any more. `descriptors`: folder of links to
/// the open files.
bool openVideoNodeVanished(const std::filesystem::path& descriptors = "/proc/self/fd");

/// Returns the descriptors of the video nodes that stream into buffers, which they do between start
/// and stop of a camera.
std::set<int> videoNodesWithBuffers(const std::filesystem::path& descriptors = "/proc/self/fd");

/// Replaces the file behind the descriptor by one that never has data and refuses video requests.
/// The owner of the descriptor must still close it.
void takeAway(int descriptor);

}  // namespace perdure::capture
