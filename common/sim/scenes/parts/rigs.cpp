#include "common/sim/scenes/parts/rigs.h"

#include <cmath>

#include "common/math/so3.h"

namespace perdure::sim {
namespace {

constexpr double kHalfFieldOfView = 40.0 * M_PI / 180.0;
constexpr double kReadout = 0.02;  ///< readout time of the rolling shutter, s

CameraCalibration makeCamera(const std::string& name, const SceneOptions& options, double left,
                             double pitch_down) {
  CameraCalibration camera;
  camera.name = name;
  camera.width = options.width;
  camera.height = options.height;
  const double width = options.width, height = options.height;
  camera.fx = camera.fy = 0.5 * width / std::tan(kHalfFieldOfView);
  camera.cx = 0.5 * width + 0.004 * width - 0.5;
  camera.cy = 0.5 * height - 0.006 * height - 0.5;
  camera.distortion = DistortionModel::kRadialTangential;
  camera.distortion_coefficients = {-0.12, 0.02, 2e-4, -1e-4};
  Eigen::Matrix3d R_BC;
  R_BC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.T_BC = RigidTransform(Eigen::Matrix3d(expSo3({0, pitch_down, 0}) * R_BC),
                               Eigen::Vector3d(kCameraBeforeBody, left, kCameraAboveBody));
  camera.readout_s = options.rolling_shutter ? kReadout : 0.0;
  camera.rate_hz = options.rate_hz;
  return camera;
}

/// Noise densities of the IMU (ADIS16448) in EuRoC's vehicle.
ImuCalibration makeImu() { return {1.7e-4, 2e-5, 2e-3, 3e-3, 200.0}; }

Eigen::Vector3d drawBias(Dice& dice, double sigma) {
  return sigma * Eigen::Vector3d(dice.normal(), dice.normal(), dice.normal());
}

}  // namespace

Rig makeRig(Carrier carrier, const SceneOptions& options, Dice& dice, double pitch_down) {
  Rig rig;
  const double baseline = carrier == Carrier::kVehicle ? 0.5 : 0.12;
  const double left = options.stereo ? 0.5 * baseline : 0.0;
  rig.calibration.cameras.push_back(makeCamera("cam0", options, left, pitch_down));
  if (options.stereo) {
    rig.calibration.cameras.push_back(makeCamera("cam1", options, -left, pitch_down));
  }
  rig.calibration.imu = makeImu();
  rig.cameras.resize(rig.calibration.cameras.size());
  rig.imu.gyro_bias = drawBias(dice, 0.004);
  rig.imu.accel_bias = drawBias(dice, 0.03);
  if (carrier == Carrier::kVehicle) rig.speed = SpeedErrors{};
  if (!options.noise) {
    for (CameraErrors& camera : rig.cameras) {
      camera.noise_electrons = camera.gain_walk = 0.0;
    }
    rig.imu.noise = false;
    rig.imu.gyro_bias.setZero();
    rig.imu.accel_bias.setZero();
    if (rig.speed) rig.speed->noise = false;
  }
  rig.calibration.has_speed = rig.speed.has_value();
  rig.true_calibration = rig.calibration;
  return rig;
}

}  // namespace perdure::sim
