// The camera, pose and gravity of one view. Derivation: tools/docs/maths/cuboid_projection.md.
#pragma once

#include <Eigen/Core>

#include "common/camera/camera_model.h"
#include "common/math/so3.h"

namespace perdure::semantic_filter {

struct View {
  const CameraModel* camera = nullptr;
  RigidTransform T_WB;
  Eigen::Vector3d up_W = Eigen::Vector3d::UnitZ();

  RigidTransform T_WC() const { return T_WB * camera->T_BC(); }
};

/// A view with the matrices that all its projections share. Converts from a View.
struct Projector {
  Projector(const View& view)  // NOLINT(google-explicit-constructor)
      : camera(view.camera),
        T_WC(view.T_WC()),
        R_CW(T_WC.q.conjugate().toRotationMatrix()),
        R_BC(view.camera->T_BC().R()),
        R_WL(levelling(view.up_W).conjugate().toRotationMatrix()) {}

  const CameraModel* camera;
  RigidTransform T_WC;
  Eigen::Matrix3d R_CW, R_BC;
  Eigen::Matrix3d R_WL;  ///< R_WL: L is W turned so that its z axis is against gravity
};

/// Returns R_WO of an upright cuboid.
inline Eigen::Matrix3d uprightRotation(double yaw, const Eigen::Vector3d& up_W) {
  return levelling(up_W).conjugate().toRotationMatrix() * rotationAboutZ(yaw);
}

}  // namespace perdure::semantic_filter
