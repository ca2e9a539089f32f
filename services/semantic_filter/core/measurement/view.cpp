#include "services/semantic_filter/core/measurement/view.h"

#include "common/math/so3.h"
namespace perdure::semantic_filter {

Projector::Projector(const View& view)
    : camera(view.camera),
      T_WC(view.T_WC()),
      R_CW(T_WC.q.conjugate().toRotationMatrix()),
      R_BC(view.camera->T_BC().R()),
      R_WL(levelling(view.up_W).conjugate().toRotationMatrix()) {}

Eigen::Matrix3d uprightRotation(double yaw, const Eigen::Vector3d& up_W) {
  return levelling(up_W).conjugate().toRotationMatrix() * rotationAboutZ(yaw);
}

}  // namespace perdure::semantic_filter
