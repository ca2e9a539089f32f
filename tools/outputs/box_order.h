// Checks boxes by themselves: whether they continue from frame to frame, and keep their class.
#pragma once

#include <optional>
#include <vector>

#include "tools/outputs/boxes/box_tracks.h"
#include "tools/outputs/run_doubts.h"

namespace perdure::tools {

/// A doubt if boxes overlap those of the next frame no better than those of a distant frame.
std::optional<Doubt> doubtOfOrder(const FrameGlances& frames);

/// A doubt if the best class changes at most steps of the tracks.
std::optional<Doubt> doubtOfClasses(const std::vector<BoxTrack>& tracks);

}  // namespace perdure::tools
