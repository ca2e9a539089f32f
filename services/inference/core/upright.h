// Chooses the turn by a multiple of 90° that brings gravity down in the image, because networks are
// trained on upright pictures.
#pragma once

#include <Eigen/Core>

namespace perdure::inference {

/// Returns the clockwise quarter turns of the image, 0 to 3. `up_C`: unit vector against gravity in
/// the camera's axes. `present`: the turn so far. It stays until the image leans by more than 55°
/// with it, and if the camera looks up or down by more than 60°.
int uprightQuarters(const Eigen::Vector3d& up_C, int present);

}  // namespace perdure::inference
