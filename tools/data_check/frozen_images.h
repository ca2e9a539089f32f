// Finds a camera that repeats the same image while the body moves.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::tools {

/// Compares the stored bytes of neighbouring images all over the drive; noise makes every new image
/// different, even of a scene at rest. A video may repeat images of such a scene, so that a finding
/// requires a moving body or jumping images. Codes: images_frozen, images_repeated.
replay::DataFindings checkFrozenImages(const replay::Recording& recording);

}  // namespace perdure::tools
