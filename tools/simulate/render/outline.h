// What share of an object is seen: its pixels in the drawn image over the pixels of its whole
// outline, drawn alone on an image plane that is larger than the image by one image on each side.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/sim/truth.h"
#include "tools/simulate/render/lens.h"
#include "tools/simulate/render/renderer.h"
#include "tools/simulate/render/workers.h"
#include "tools/simulate/render/world.h"

namespace perdure::tools {

/// An object alone.
struct Outline {
  double area = 0.0;  ///< pixels² of the enlarged plane
  Box box;            ///< of its corners, within the enlarged plane
  /// Of the part within the image; set where the border cuts it.
  std::optional<Box> inside;
};
/// area 0 where the object is behind the camera or beside the enlarged plane.
Outline outlineOf(const Surface& surface, const RigidTransform& T_CO, const Lens& lens);

/// One row for each present object whose outline's box touches the image, by id. `seen` is of
/// render() or identify() of the same shot, `step` that of identify() or 1.
std::vector<sim::TruthView> viewsOf(const World& world, const Lens& lens, const Shot& shot,
                                    const Picture& seen, int step, Workers& workers);

}  // namespace perdure::tools
