// Projection of common/camera as a template for Ceres' dual numbers.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "common/types/sensors.h"

namespace perdure::calibrate {

/// focal: fx, fy, cx, cy in pixels; distortion: four coefficients (not read if the model has none).
template <class T>
Eigen::Matrix<T, 2, 1> projectPoint(DistortionModel model, const T* focal, const T* distortion,
                                    const Eigen::Matrix<T, 3, 1>& point_C) {
  using std::atan2;
  using std::sqrt;
  const T x = point_C.x() / point_C.z(), y = point_C.y() / point_C.z();
  const T r2 = x * x + y * y;
  T u = x, v = y;
  if (model == DistortionModel::kRadialTangential) {
    const T radial = T(1.0) + r2 * (distortion[0] + r2 * distortion[1]);
    const T &p1 = distortion[2], &p2 = distortion[3];
    u = x * radial + T(2.0) * p1 * x * y + p2 * (r2 + T(2.0) * x * x);
    v = y * radial + p1 * (r2 + T(2.0) * y * y) + T(2.0) * p2 * x * y;
  } else if (model == DistortionModel::kEquidistant && r2 > T(1e-16)) {
    const T r = sqrt(r2), t = atan2(r, T(1.0)), t2 = t * t;
    const T poly = T(1.0) + t2 * (distortion[0] +
                                  t2 * (distortion[1] + t2 * (distortion[2] + t2 * distortion[3])));
    u = x * t * poly / r;
    v = y * t * poly / r;
  }
  return {focal[0] * u + focal[2], focal[1] * v + focal[3]};
}

}  // namespace perdure::calibrate
