#include "services/vio/cameras.h"

#include <algorithm>

#include "common/vision/image.h"

namespace perdure::vio {
namespace {

/// Returns the largest distance, as a share of the width, between the pixels of distant points in
/// both cameras.
double largestShift(const CameraModel& before, const CameraModel& now) {
  const Eigen::Matrix3d R = now.T_BC().R().transpose() * before.T_BC().R();
  double largest = 0.0;
  for (const double x : {0.1, 0.5, 0.9}) {
    for (const double y : {0.1, 0.5, 0.9}) {
      const Eigen::Vector2d pixel(x * before.width(), y * before.height());
      const auto ray = before.unproject(pixel);
      const auto moved = ray ? now.project(R * ray->homogeneous()) : std::nullopt;
      if (moved) largest = std::max(largest, (*moved - pixel).norm() / before.width());
    }
  }
  return largest;
}

std::string sizeText(std::uint32_t width, std::uint32_t height) {
  return std::to_string(width) + "×" + std::to_string(height);
}

}  // namespace

std::vector<CameraModel> usedCameras(const Config& config, const Calibration& calibration) {
  const std::size_t wanted = config.stereo ? 2 : 1;
  std::vector<CameraModel> used;
  for (const std::string& name : config.cameras) {
    const CameraCalibration* camera = calibration.camera(name);
    const bool again = !used.empty() && used.front().calibration().name == name;
    if (camera != nullptr && !again && used.size() < wanted) used.emplace_back(*camera);
  }
  if (used.empty()) used.emplace_back(calibration.cameras.at(0));
  return used;
}

std::string unknownCamera(const Config& config, const Calibration& calibration) {
  if (config.cameras == Config{}.cameras) return {};
  for (const std::string& name : config.cameras) {
    if (calibration.camera(name) != nullptr) continue;
    std::string known;
    for (const auto& camera : calibration.cameras)
      known += (known.empty() ? "" : ", ") + camera.name;
    return "input.cameras names " + name + ", which the calibration does not (" + known + ")";
  }
  return {};
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

void useDeviations(const CameraDeviations& rig, CalibrationOptions& options) {
  const CalibrationOptions usual;
  const auto use = [](double given, double otherwise, double& value) {
    if (given > 0.0 && value == otherwise) value = given;
  };
  use(rig.focal, usual.focal, options.focal);
  use(rig.centre_px, usual.centre_px, options.centre_px);
  use(rig.distortion, usual.distortion, options.distortion);
  use(rig.rotation, usual.extrinsic_rotation, options.extrinsic_rotation);
  use(rig.position_m, usual.extrinsic_position_m, options.extrinsic_position_m);
  use(rig.time_offset_s, usual.time_offset_s, options.time_offset_s);
}

void CameraNews::begin(const Calibration& given) {
  given_ = given;
  again_ = !published_.empty();
}

std::optional<Calibration> CameraNews::take(const Estimator& estimator,
                                            const std::vector<CameraModel>& models) {
  constexpr double kNoticeable = 0.0025;  // of the width: 0.15 to 0.2° for usual lenses
  const bool approximate = estimator.options().calibration.estimated().lens;
  if (published_.empty() && !approximate && !estimator.mountTurn()) return std::nullopt;
  constexpr std::chrono::seconds kApart{2};
  const Duration since = estimator.state().time - time_;
  const bool soon = !published_.empty() && since >= Duration::zero() && since < kApart;
  if (soon && !again_) return std::nullopt;
  std::vector<CameraModel> now = estimator.cameras(models);
  const CameraModel& before = published_.empty() ? models[0] : published_[0];
  if (!again_ && largestShift(before, now[0]) < kNoticeable) return std::nullopt;
  again_ = false;
  Calibration news = given_;
  for (const CameraModel& model : now) {
    for (CameraCalibration& camera : news.cameras) {
      if (camera.name == model.calibration().name) camera = model.calibration();
    }
  }
  published_ = std::move(now);
  time_ = estimator.state().time;
  return news;
}

bool sameCameras(const Calibration& a, const Calibration& b) {
  return std::equal(a.cameras.begin(), a.cameras.end(), b.cameras.begin(), b.cameras.end(),
                    sameCamera);
}

std::string otherSize(const Frame& frame, const CameraModel& model) {
  const auto width = static_cast<std::uint32_t>(model.width());
  const auto height = static_cast<std::uint32_t>(model.height());
  if (frame.width == width && frame.height == height) return {};
  return "frames of " + frame.camera + " are " + sizeText(frame.width, frame.height) +
         ", their calibration is for " + sizeText(width, height) +
         "; set the camera to that size, or calibrate it at its own";
}

std::optional<std::size_t> cameraOf(const Frame& frame, const std::vector<CameraModel>& models,
                                    const Calibration& calibration, ReasonCounts& reasons) {
  for (std::size_t i = models.size(); i-- > 0;) {
    if (frame.camera == models[i].calibration().name) return i;
  }
  if (!calibration.camera(frame.camera)) reasons.add("frame_of_unknown_camera");
  return std::nullopt;
}

cv::Mat secondImage(const FramePair& frames, bool stereo, ReasonCounts& reasons) {
  if (!frames.second) {
    if (stereo) reasons.add("stereo_unpaired");
    return {};
  }
  const auto image = vision::monoOf(*frames.second);
  if (!image) reasons.add(image.error());
  return image ? *image : cv::Mat();
}

}  // namespace perdure::vio
