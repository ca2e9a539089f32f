// Finds a camera that repeats one image while the body moves.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::tools {

/// Compares the stored bytes of neighbours at places all over the drive: noise makes every image
/// different, even of a scene at rest. A video of a scene at rest may repeat images, so the body
/// must move, or the images must jump. Codes: images_frozen, images_repeated.
replay::DataFindings checkFrozenImages(const replay::Recording& recording);

}  // namespace perdure::tools
