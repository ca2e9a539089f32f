#include "tests/tools/calibrate/motion/moving_camera.h"

#include <cmath>
#include <random>

#include "common/camera/camera_model.h"
#include "common/math/so3.h"
#include "tests/support/camera.h"

namespace perdure::tests {
namespace {

constexpr double kFine_s = 0.001, kImages_hz = 20.0, kFirst_s = 1.0;
constexpr int kImages = 7;

/// The true motion in steps of kFine_s.
class Path {
 public:
  Path(const MovingCameraOptions& options, double seconds) : options_(options) {
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    for (double t = 0.0; t < seconds; t += kFine_s) {
      turned_.push_back(q);
      q = (q * expQuaternion(kFine_s * rateAt(t + 0.5 * kFine_s))).normalized();
    }
  }
  Eigen::Vector3d rateAt(double t) const {
    return options_.turning.cwiseProduct(
        Eigen::Vector3d(std::sin(5.1 * t), std::cos(4.3 * t), std::sin(3.2 * t + 1.0)));
  }
  Eigen::Vector3d accelerationAt(double t) const {
    return -options_.way_m * Eigen::Vector3d(9.0 * std::sin(3.0 * t), 16.0 * std::cos(4.0 * t),
                                             25.0 * std::sin(5.0 * t + 0.5));
  }
  RigidTransform at(double t) const {
    const auto i = static_cast<std::size_t>(t / kFine_s);
    const double left = t - static_cast<double>(i) * kFine_s;
    const Eigen::Vector3d p(std::sin(3.0 * t), std::cos(4.0 * t), std::sin(5.0 * t + 0.5));
    return {turned_[i] * expQuaternion(left * rateAt(t - 0.5 * left)), options_.way_m * p};
  }

 private:
  const MovingCameraOptions& options_;
  std::vector<Eigen::Quaterniond> turned_;
};

TimePoint timeOf(double t_s) { return TimePoint(durationFromSeconds(t_s)); }

/// Pixel of a point in the image with this stamp; a row is exposed at its own time.
std::optional<Eigen::Vector2d> pixelOf(const CameraModel& camera, const Path& path, double stamp_s,
                                       const Eigen::Vector3d& point_W) {
  const CameraCalibration& c = camera.calibration();
  Eigen::Vector2d pixel(0.5 * c.width, 0.5 * c.height);
  for (int round = 0; round < 5; ++round) {
    const double share = pixel.y() / (c.height - 1.0) - 0.5;
    const RigidTransform T_WC = path.at(stamp_s + c.time_offset_s + share * c.readout_s) * c.T_BC;
    const auto seen = camera.project(T_WC.inverse() * point_W);
    if (!seen || !camera.inImage(*seen, 5.0)) return std::nullopt;
    pixel = *seen;
  }
  return pixel;
}

}  // namespace

MovingCamera moveCamera(const MovingCameraOptions& options) {
  MovingCamera moving{options.truth, {}, {}};
  std::mt19937 random(options.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const double seconds = 2.0 * kFirst_s + 0.5 * static_cast<double>(options.windows);
  const Path path(options, seconds + 0.1);
  const CameraModel camera(options.truth.camera);
  for (double t = 0.0; t < seconds; t += 0.005) {
    ImuSample sample;
    sample.time = timeOf(t);
    sample.gyro = path.rateAt(t) + options.truth.gyro_bias;
    sample.accel =
        path.at(t).q.conjugate() * (path.accelerationAt(t) + Eigen::Vector3d(0, 0, 9.81));
    moving.samples.push_back(sample);
  }
  for (std::size_t k = 0; k < options.windows; ++k) {
    const double from = kFirst_s + 0.5 * static_cast<double>(k);
    calibrate::TrackWindow window;
    for (int i = 0; i < kImages; ++i) window.times.push_back(timeOf(from + i / kImages_hz));
    const RigidTransform T_WC = path.at(from) * options.truth.camera.T_BC;
    for (int tries = 0; window.tracks.size() < options.points && tries < 1000; ++tries) {
      const Eigen::Vector2d pixel(640.0 * uniform(random), 480.0 * uniform(random));
      const auto ray = camera.unproject(pixel);
      if (!ray) continue;
      const Eigen::Vector3d point = T_WC * ((1.0 + 6.0 * uniform(random)) * ray->homogeneous());
      calibrate::Track track;
      for (int i = 0; i < kImages; ++i) {
        const auto seen = pixelOf(camera, path, from + i / kImages_hz, point);
        if (!seen) break;
        track.push_back(*seen + options.sigma_px * Eigen::Vector2d(normal(random), normal(random)));
      }
      if (track.size() >= 2) window.tracks.push_back(track);
    }
    moving.windows.push_back(window);
  }
  return moving;
}

calibrate::JointState phoneWith(double focal, double offset_s, double readout_s) {
  calibrate::JointState state;
  CameraCalibration& camera = state.camera;
  camera.name = "cam0", camera.width = 640, camera.height = 480;
  camera.fx = camera.fy = focal, camera.cx = 321.5, camera.cy = 238.0;
  camera.distortion = DistortionModel::kRadialTangential;
  camera.distortion_coefficients = {-0.05, 0.02, 0.0, 0.0};
  camera.T_BC = RigidTransform(lookingAhead(), {0.03, 0.0, 0.02});
  camera.time_offset_s = offset_s, camera.readout_s = readout_s;
  state.gyro_bias = Eigen::Vector3d(0.01, -0.02, 0.005);
  return state;
}

}  // namespace perdure::tests
