// From where a scene is seen.
#pragma once

#include <Eigen/Core>

#include "common/camera/camera_model.h"

namespace perdure::semantic_filter {

/// From where the scene is seen: everything that a projection needs.
struct View {
  const CameraModel* camera = nullptr;
  RigidTransform T_WB;
  Eigen::Vector3d up_W = Eigen::Vector3d::UnitZ();

  RigidTransform T_WC() const { return T_WB * camera->T_BC(); }
};

/// A view with what all projections from it share; a View where there is but one.
struct Projector {
  Projector(const View& view);  // NOLINT(google-explicit-constructor)

  const CameraModel* camera;
  RigidTransform T_WC;
  Eigen::Matrix3d R_CW, R_BC;
  Eigen::Matrix3d R_WL;  ///< from W turned so that z is against gravity
};

/// R_WO of an upright cuboid.
Eigen::Matrix3d uprightRotation(double yaw, const Eigen::Vector3d& up_W);

}  // namespace perdure::semantic_filter
