// Computes the visible share of an object: its visible pixels in the image divided by the pixels of
// its complete outline. The outline is drawn without other objects, on an image plane that extends
// the image by its own size on each side.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/sim/truth.h"
#include "tools/simulate/render/lens.h"
#include "tools/simulate/render/renderer.h"
#include "tools/simulate/render/workers.h"
#include "tools/simulate/render/world.h"

namespace perdure::tools {

struct Outline {
  double area = 0.0;  ///< pixels² of the enlarged plane
  Box box;            ///< box of its corners, within the enlarged plane
  /// Box of the part within the image; set if the border truncates the object.
  std::optional<Box> inside;
};
/// Draws the outline; its area is 0 if the object is behind the camera or outside the enlarged
/// plane.
Outline outlineOf(const Surface& surface, const RigidTransform& T_CO, const Lens& lens);

/// Returns a row, by id, for each present object whose outline box touches the image. `seen`:
/// result of render() or identify() for the same shot; `step`: that of identify(), 1 for render().
std::vector<sim::TruthView> viewsOf(const World& world, const Lens& lens, const Shot& shot,
                                    const Picture& seen, int step, Workers& workers);

}  // namespace perdure::tools
