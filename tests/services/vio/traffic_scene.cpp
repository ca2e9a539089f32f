#include "tests/services/vio/traffic_scene.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "common/vision/image.h"

namespace perdure::vio::test {
namespace {

using Eigen::Vector3d;

constexpr int kWidth = 320, kHeight = 240, kLong = 6400;
constexpr double kFocal = 200.0, kGyro = 1.7e-4, kAccel = 2e-3, kImuRate = 200.0;

}  // namespace

TrafficScene::TrafficScene(const TrafficOptions& options)
    : options_(options), random_(options.seed) {
  background_ = texture(kLong, kHeight, 6);
  const int rows = static_cast<int>(kHeight * options.cover);
  if (rows > 0) traffic_ = texture(kLong, rows, 7);
}

TimePoint TrafficScene::time(double t) {
  return fromNanoseconds(1'000'000'000'000) + durationFromSeconds(t);
}

Calibration TrafficScene::calibration() {
  Calibration c;
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx = camera.fy = kFocal;
  camera.cx = kWidth / 2.0;
  camera.cy = kHeight / 2.0;
  camera.rate_hz = 20.0;
  Eigen::Matrix3d R_BC;
  R_BC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.T_BC = RigidTransform(Eigen::Quaterniond(R_BC), Vector3d::Zero());
  c.cameras = {camera};
  c.imu = ImuCalibration{kGyro, 2e-5, kAccel, 3e-3, kImuRate};
  return c;
}

cv::Mat TrafficScene::texture(int width, int height, int grain) {
  cv::Mat coarse(std::max(2, height / grain + 1), width / grain + 1, CV_8UC1), fine;
  random_.fill(coarse, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(coarse, coarse, {0, 0}, 0.8);
  cv::resize(coarse, fine, {width, height}, 0, 0, cv::INTER_CUBIC);
  cv::normalize(fine, fine, 25, 230, cv::NORM_MINMAX);
  return fine;
}

Vector3d TrafficScene::motion(double t) const {
  return options_.slide ? options_.slide(t) : Vector3d::Zero();
}

Vector3d TrafficScene::position(double t) const { return {0, motion(t).x(), 0}; }

Vector3d TrafficScene::noise(double sigma) {
  return {random_.gaussian(sigma), random_.gaussian(sigma), random_.gaussian(sigma)};
}

/// Returns columns of `strip` from a fractional position, wrapped around.
cv::Mat columnsFrom(const cv::Mat& strip, double from) {
  const double room = strip.cols - kWidth - 2;
  const double at = from - room * std::floor(from / room);
  cv::Mat result;
  cv::getRectSubPix(strip, {kWidth, strip.rows},
                    cv::Point2f(static_cast<float>(at + (kWidth - 1) / 2.0),
                                static_cast<float>((strip.rows - 1) / 2.0)),
                    result);
  return result;
}

Frame TrafficScene::frame(double t) {
  // The body moves to its left, the image to the right.
  const double slid = kFocal * motion(t).x() / options_.wall_m;
  cv::Mat image = columnsFrom(background_, 3000.0 - (options_.far_background ? 0.0 : slid));
  if (t >= options_.begins_s && traffic_.rows > 0) {
    const double passed = (t - options_.begins_s) * options_.speed_px_s;
    columnsFrom(traffic_, 3000.0 - passed - slid)
        .copyTo(image.rowRange(kHeight - traffic_.rows, kHeight));
  }
  cv::Mat noisy(image.size(), CV_16SC1);
  random_.fill(noisy, cv::RNG::NORMAL, 0, 2);
  cv::add(image, noisy, image, cv::noArray(), CV_8U);
  Frame frame;
  frame.stamp = {1, sequence_++, time(t), 0};
  frame.camera = "cam0";
  (void)vision::setPixels(frame, image);
  return frame;
}

ImuSample TrafficScene::imu(double t) {
  const double root = std::sqrt(kImuRate), phase = 2.0 * M_PI * 27.0 * t;
  const Vector3d shake =
      options_.engine * Vector3d(std::sin(phase), std::sin(phase + 1), std::sin(phase + 2));
  ImuSample s;
  s.source = 1;
  s.sequence = static_cast<std::uint64_t>(std::lround(t * kImuRate));
  s.time = time(t);
  s.gyro = noise(kGyro * root) + Vector3d(.003, -.002, .004) + 0.01 * shake;
  s.accel =
      noise(kAccel * root) + Vector3d(.05, -.03, .04) + shake + Vector3d(0, motion(t).z(), 9.81);
  return s;
}

}  // namespace perdure::vio::test
