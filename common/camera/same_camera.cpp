#include "common/camera/same_camera.h"

namespace perdure {

bool sameCamera(const CameraCalibration& a, const CameraCalibration& b) {
  return a.name == b.name && a.width == b.width && a.height == b.height && a.fx == b.fx &&
         a.fy == b.fy && a.cx == b.cx && a.cy == b.cy && a.distortion == b.distortion &&
         a.distortion_coefficients == b.distortion_coefficients &&
         a.T_BC.matrix() == b.T_BC.matrix() && a.time_offset_s == b.time_offset_s &&
         a.readout_s == b.readout_s;
}

}  // namespace perdure
