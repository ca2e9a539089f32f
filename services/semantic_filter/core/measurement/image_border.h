// What the image's border leaves of a box: the part of the object that a detector sees. Derivation:
// tools/docs/maths/cuboid_projection.md.
#pragma once

#include "services/semantic_filter/core/measurement/cuboid_corners.h"

namespace perdure::semantic_filter {

/// Where the border cuts the object, moves the other two sides of its box to the part inside. A
/// side beyond the border stays where it is.
void endWithinImage(ProjectedBox& box, const Corners& corners, const ImagePoints& points,
                    const Projector& from);

}  // namespace perdure::semantic_filter
