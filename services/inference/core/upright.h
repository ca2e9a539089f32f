// The turn by a multiple of 90° that brings gravity down: networks are trained on upright pictures.
#pragma once

#include <Eigen/Core>

namespace perdure::inference {

/// Clockwise quarter turns, 0 to 3. `up_C`: against gravity. `present` stays until the image leans
/// by more than 55°, and if the camera looks up or down by more than 60°.
int uprightQuarters(const Eigen::Vector3d& up_C, int present);

}  // namespace perdure::inference
