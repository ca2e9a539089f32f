#include "services/vio/cameras.h"

#include <algorithm>

#include "common/camera/same_camera.h"

namespace perdure::vio {

std::vector<CameraModel> usedCameras(const Config& config, const Calibration& calibration) {
  std::vector<CameraModel> used{CameraModel(calibration.cameras.at(0))};
  if (!config.stereo || calibration.cameras.size() < 2) return used;
  const CameraCalibration& second = calibration.cameras[1];
  if (std::count(config.cameras.begin(), config.cameras.end(), second.name) > 0) {
    used.emplace_back(second);
  }
  return used;
}

std::vector<RigidTransform> extrinsics(const std::vector<CameraModel>& all) {
  std::vector<RigidTransform> T_BC;
  for (const CameraModel& m : all) T_BC.push_back(m.T_BC());
  return T_BC;
}

std::vector<double> readouts(const std::vector<CameraModel>& all) {
  std::vector<double> readout_s;
  for (const CameraModel& m : all) readout_s.push_back(m.calibration().readout_s);
  return readout_s;
}

Cameras::Cameras(const Config& config, const Options& options, const std::vector<CameraModel>& all)
    : tracker(config.tracker, all),
      estimator(options, extrinsics(all), all[0].calibration().time_offset_s, readouts(all)),
      models(all) {}

bool sameCameras(const Calibration& a, const Calibration& b) {
  return std::equal(a.cameras.begin(), a.cameras.end(), b.cameras.begin(), b.cameras.end(),
                    sameCamera);
}

}  // namespace perdure::vio
