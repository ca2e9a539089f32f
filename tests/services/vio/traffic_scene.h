// Images and samples of a vehicle that stands before moving traffic, or slides along a wall. There
// are two textures; the lower one moves through the image. Seeded.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <opencv2/core.hpp>

#include "common/types/sensors.h"

namespace perdure::vio::test {

struct TrafficOptions {
  unsigned seed = 1;
  double cover = 0.8;           ///< share of the image, from the bottom
  double begins_s = 5.0;        ///< start of the traffic; before it there is no traffic
  double speed_px_s = 80.0;     ///< speed of the traffic
  double engine = 0.0;          ///< vibration at 27 Hz in m/s²; a hundredth of it in rad/s
  double wall_m = 8.0;          ///< distance of the static part, m
  bool far_background = false;  ///< the background is at infinity: it does not move with the body
  /// Distance that the body has slid to its left in m, with velocity and acceleration; empty: it
  /// stands.
  std::function<Eigen::Vector3d(double)> slide = {};  ///< (p, v, a) at a time
};

class TrafficScene {
 public:
  explicit TrafficScene(const TrafficOptions& options);

  static Calibration calibration();
  /// Frame and sample at `t` seconds from the start. Use frames every .05 s and samples every .005
  /// s, in rising order.
  Frame frame(double t);
  ImuSample imu(double t);
  Eigen::Vector3d position(double t) const;
  static TimePoint time(double t);

 private:
  cv::Mat texture(int width, int height, int grain);
  Eigen::Vector3d noise(double sigma);
  Eigen::Vector3d motion(double t) const;

  TrafficOptions options_;
  cv::RNG random_;
  cv::Mat background_, traffic_;
  std::uint64_t sequence_ = 0;
};

}  // namespace perdure::vio::test
