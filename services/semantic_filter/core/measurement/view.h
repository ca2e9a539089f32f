// The camera, pose and gravity of one view. Derivation: tools/docs/maths/cuboid_projection.md.
#pragma once

#include <Eigen/Core>

#include "common/camera/camera_model.h"

namespace perdure::semantic_filter {

/// Everything that a projection needs.
struct View {
  const CameraModel* camera = nullptr;
  RigidTransform T_WB;
  Eigen::Vector3d up_W = Eigen::Vector3d::UnitZ();

  RigidTransform T_WC() const { return T_WB * camera->T_BC(); }
};

/// A view with the matrices that all projections from it share. It converts from a View, for a
/// single projection.
struct Projector {
  Projector(const View& view);  // NOLINT(google-explicit-constructor)

  const CameraModel* camera;
  RigidTransform T_WC;
  Eigen::Matrix3d R_CW, R_BC;
  Eigen::Matrix3d R_WL;  ///< R_WL: L is W turned so that its z axis is against gravity
};

/// Returns R_WO of an upright cuboid.
Eigen::Matrix3d uprightRotation(double yaw, const Eigen::Vector3d& up_W);

}  // namespace perdure::semantic_filter
