#include "tests/services/vio/simulated_drive.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "common/math/so3.h"
#include "tests/support/camera.h"

namespace perdure::vio::test {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double kStreetLength = 620.0, kStreetSpeed = 8.5;  // m, m/s
constexpr double kFarthest = 80.0;                           // m: farther points are not visible

}  // namespace

cv::Mat texture(unsigned seed) {
  cv::Mat noise(480, 752, CV_8UC1), smooth;
  std::mt19937 random(seed);
  for (int y = 0; y < noise.rows; ++y) {
    for (int x = 0; x < noise.cols; ++x) noise.at<std::uint8_t>(y, x) = random() % 256;
  }
  cv::GaussianBlur(noise, smooth, {9, 9}, 2.5);
  cv::normalize(smooth, smooth, 0, 255, cv::NORM_MINMAX);
  return smooth;
}

cv::Mat shifted(const cv::Mat& image, double dx, double dy) {
  const cv::Mat A = (cv::Mat_<double>(2, 3) << 1, 0, dx, 0, 1, dy);
  cv::Mat result;
  cv::warpAffine(image, result, A, image.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  return result;
}

CameraCalibration testCamera(int index) {
  CameraCalibration c;
  c.name = index == 0 ? "cam0" : "cam1";
  c.width = 752;
  c.height = 480;
  c.fx = 458.654;
  c.fy = 457.296;
  c.cx = 367.215;
  c.cy = 248.375;
  c.distortion = DistortionModel::kRadialTangential;
  c.distortion_coefficients = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  c.T_BC = RigidTransform(tests::lookingAhead(), Vector3d(0.05, 0.06 - 0.11 * index, 0.02));
  c.rate_hz = 20.0;
  return c;
}

SimulatedDrive::SimulatedDrive(const DriveOptions& options)
    : options_(options), random_(options.seed) {
  for (int c = 0; c < (options.stereo ? 2 : 1); ++c) {
    CameraCalibration camera = testCamera(c);
    camera.readout_s = options.readout_s;
    camera.T_BC.p.x() += options.camera_ahead_m;
    cameras_.emplace_back(camera);
  }
  options.place == DrivePlace::kStreet ? buildStreet() : buildRoom();
  ids_.assign(points_.size(), 0);
}

/// Places points on walls, floor and ceiling.
void SimulatedDrive::buildRoom() {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (int i = 0; i < options_.points; ++i) {
    Vector3d p(6.0 * u(random_), 6.0 * u(random_), 3.0 * u(random_));
    const int wall = i % 6;
    p[wall % 3] = (wall < 3 ? 1.0 : -1.0) * (wall % 3 == 2 ? 3.0 : 6.0);
    points_.push_back(p);
  }
}

/// Places points on both sides and on the ground, 1.5 m below the body.
void SimulatedDrive::buildStreet() {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const int count = static_cast<int>(options_.points * kStreetLength / 150.0);
  for (int i = 0; i < count; ++i) {
    const double x = 0.5 * kStreetLength * (1.0 + u(random_));
    if (i % 4 == 0) {
      points_.emplace_back(x, 6.0 * u(random_), -1.5);
    } else {
      const double side = i % 2 == 0 ? 1.0 : -1.0;
      points_.emplace_back(x, side * (8.0 + 4.0 * u(random_)), 1.75 + 3.25 * u(random_));
    }
  }
}

std::vector<RigidTransform> SimulatedDrive::T_BC() const {
  std::vector<RigidTransform> result;
  for (const CameraModel& c : cameras_) result.push_back(c.T_BC());
  return result;
}

// Time along the path: zero during the rest, then increasing smoothly (three times differentiable).
double SimulatedDrive::phase(double t) const {
  const double s = t - options_.rest_s;
  if (options_.rest_s <= 0.0) return t;
  if (s <= 0.0) return 0.0;
  const double rise = options_.place == DrivePlace::kStreet ? 6.0 : 2.0;
  if (s >= rise) return s - 0.5 * rise;
  const double x = s / rise;  // speed 10x³ − 15x⁴ + 6x⁵, integrated
  return rise * (2.5 * x * x * x * x - 3.0 * std::pow(x, 5) + std::pow(x, 6));
}

Vector3d SimulatedDrive::position(double t) const {
  const double s = phase(t);
  if (options_.place == DrivePlace::kStreet) return {kStreetSpeed * s, 0.0, 0.0};
  if (options_.place == DrivePlace::kSpot) {
    const double yaw = 0.5 * options_.spot_pace * s;
    return options_.spot_radius_m * Vector3d(std::cos(yaw), std::sin(yaw), 0.0);
  }
  return {2.5 * std::cos(0.5 * s), 2.0 * std::sin(0.5 * s) + 0.3 * std::sin(1.7 * s),
          0.5 * std::sin(0.9 * s)};
}

Matrix3d SimulatedDrive::rotation(double t) const {
  double s = phase(t);
  if (options_.place == DrivePlace::kSpot) s *= options_.spot_pace;
  if (options_.place == DrivePlace::kStreet) {
    return rotationAboutZ(0.003 * std::sin(0.7 * s)) *
           expSo3(Vector3d(0.002 * std::sin(1.3 * s), 0.004 * std::sin(2.1 * s), 0));
  }
  return rotationAboutZ(0.5 * s + 0.2) * expSo3(Vector3d(0, 0.15 * std::sin(1.1 * s), 0)) *
         expSo3(Vector3d(0.2 * std::sin(0.8 * s), 0, 0));
}

Vector3d SimulatedDrive::rateTruth(double t) const {
  constexpr double h = 1e-4;
  return logSo3(Matrix3d(rotation(t - h).transpose() * rotation(t + h))) / (2.0 * h);
}

Vector3d SimulatedDrive::forceTruth(double t) const {
  constexpr double h = 1e-3;
  const Vector3d a = (-position(t - 2 * h) + 16.0 * position(t - h) - 30.0 * position(t) +
                      16.0 * position(t + h) - position(t + 2 * h)) /
                     (12.0 * h * h);
  return rotation(t).transpose() * (a + Vector3d(0, 0, 9.81));
}

Nav SimulatedDrive::truth(double t) const {
  constexpr double h = 1e-4;
  Nav nav;
  nav.q_WB = Eigen::Quaterniond(rotation(t));
  nav.p_WB = position(t);
  nav.v_WB = (position(t + h) - position(t - h)) / (2.0 * h);
  nav.gyro_bias = options_.gyro_bias;
  nav.accel_bias = options_.accel_bias;
  if (!biases_.empty()) {
    const auto i = static_cast<std::size_t>(std::max(0.0, std::round(t * options_.imu_rate_hz)));
    std::tie(nav.gyro_bias, nav.accel_bias) = biases_[std::min(i, biases_.size() - 1)];
  }
  return nav;
}

Vector3d SimulatedDrive::noise(double sigma) {
  return sigma * Vector3d(normal_(random_), normal_(random_), normal_(random_));
}

std::vector<ImuReading> SimulatedDrive::imu(double until) {
  std::vector<ImuReading> result;
  const double dt = 1.0 / options_.imu_rate_hz, root = std::sqrt(options_.imu_rate_hz);
  Vector3d gyro_bias = options_.gyro_bias, accel_bias = options_.accel_bias;
  for (int i = 0; i * dt <= until; ++i) {
    const double t = i * dt;
    const Vector3d rate = options_.gyro_scale.cwiseProduct(rateTruth(t));
    result.push_back({time(t), rate + gyro_bias + noise(options_.noise.gyro * root),
                      forceTruth(t) + accel_bias + noise(options_.noise.accel * root)});
    if (!options_.walking_biases) continue;
    biases_.emplace_back(gyro_bias, accel_bias);
    gyro_bias += noise(options_.noise.gyro_walk / root);
    accel_bias += noise(options_.noise.accel_walk / root);
  }
  return result;
}

Eigen::Vector2d SimulatedDrive::pixelOf(std::size_t point, double t) const {
  const RigidTransform T_WC = truth(t).T_WB() * cameras_[0].T_BC();
  return cameras_[0].project(T_WC.inverse() * points_[point]).value_or(Eigen::Vector2d(-1, -1));
}

RigidTransform SimulatedDrive::seenFrom(double t) const {
  RigidTransform T_WB = truth(t + options_.time_offset_s).T_WB();
  if (t >= options_.mount_from_s) T_WB = T_WB * options_.mount;
  return t >= options_.jump_from_s && t < options_.jump_until_s ? options_.jump * T_WB : T_WB;
}

std::optional<Eigen::Vector2d> SimulatedDrive::project(std::size_t c, const Vector3d& p_W,
                                                       double t) const {
  const CameraModel& camera = cameras_[c];
  auto pixel = camera.project((seenFrom(t) * camera.T_BC()).inverse() * p_W);
  if (options_.readout_s == 0.0) return pixel;
  // The row and the time of its exposure depend on each other. Each iteration reduces the error to
  // about a hundredth.
  for (int i = 0; i < 3 && pixel; ++i) {
    const double row = pixel->y() / (camera.height() - 1) - 0.5;
    const RigidTransform T_WB = seenFrom(t + row * options_.readout_s);
    pixel = camera.project((T_WB * camera.T_BC()).inverse() * p_W);
  }
  return pixel;
}

TrackedFrame SimulatedDrive::see(double t) {
  const RigidTransform T_WB = seenFrom(t);
  std::vector<std::size_t> seen, fresh;
  std::vector<std::array<std::optional<ImagePoint>, kMaxCameras>> views(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      const auto pixel = project(c, points_[i], t);
      if (!pixel || !cameras_[c].inImage(*pixel, 5.0)) continue;
      if ((points_[i] - T_WB.p).norm() > kFarthest) continue;
      const Eigen::Vector2d noisy = *pixel + noise(options_.pixel_sigma).head<2>();
      views[i][c] = imagePoint(cameras_[c], noisy);
    }
    if (!views[i][0]) {
      ids_[i] = 0;
    } else {
      (ids_[i] ? seen : fresh).push_back(i);
    }
  }
  for (const std::size_t i : fresh) {
    if (static_cast<int>(seen.size()) >= options_.points_per_image) break;
    ids_[i] = next_id_++;
    seen.push_back(i);
  }
  TrackedFrame frame;
  for (const std::size_t i : seen) frame.points.push_back({ids_[i], views[i]});
  std::sort(frame.points.begin(), frame.points.end(),
            [](const TrackedPoint& a, const TrackedPoint& b) { return a.id < b.id; });
  return frame;
}

Start startAt(const SimulatedDrive& drive, double t, unsigned seed, double scale) {
  std::mt19937 random(seed + 99);
  std::normal_distribution<double> n;
  const auto draw = [&](double s) { return Vector3d(s * n(random), s * n(random), s * n(random)); };
  Start start;
  start.time = drive.time(t);
  start.nav = drive.truth(t);
  const double theta = 0.01 * scale, v = 0.05 * scale, bg = 0.005 * scale, ba = 0.05 * scale;
  Vector3d tilt = draw(theta);
  // Yaw is a gauge, so that the start has no error of yaw.
  tilt = start.nav.q_WB * tilt;
  tilt.z() = 0.0;
  tilt = start.nav.q_WB.conjugate() * tilt;
  start.nav.q_WB = start.nav.q_WB * expQuaternion(tilt);
  start.nav.v_WB += draw(v);
  start.nav.gyro_bias += draw(bg);
  start.nav.accel_bias += draw(ba);
  start.covariance.setZero();
  const Eigen::Matrix3d R = start.nav.q_WB.toRotationMatrix();
  start.covariance.block<3, 3>(0, 0) =
      R.transpose() * Vector3d(theta * theta, theta * theta, 1e-10).asDiagonal() * R;
  start.covariance.diagonal().segment<3>(3).setConstant(1e-10);
  start.covariance.diagonal().segment<3>(6).setConstant(v * v);
  start.covariance.diagonal().segment<3>(9).setConstant(bg * bg);
  start.covariance.diagonal().segment<3>(12).setConstant(ba * ba);
  return start;
}

}  // namespace perdure::vio::test
