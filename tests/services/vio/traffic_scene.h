// What a vehicle sees and feels that stands before moving traffic, or slides along a wall: two
// textures, of which the lower one moves through the picture. Seeded.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <opencv2/core.hpp>

#include "common/types/sensors.h"

namespace perdure::vio::test {

struct TrafficOptions {
  unsigned seed = 1;
  double cover = 0.8;           ///< share of the picture, from below
  double begins_s = 5.0;        ///< when the traffic begins to move; before it there is none
  double speed_px_s = 80.0;     ///< of the traffic
  double engine = 0.0;          ///< m/s² of vibration at 27 Hz; a hundredth of it in rad/s
  double wall_m = 8.0;          ///< how far the standing part is
  bool far_background = false;  ///< as if it were at infinity: it does not move with the body
  /// How far the body has slid to its left, m, with velocity and acceleration; empty: it stands.
  std::function<Eigen::Vector3d(double)> slide = {};  ///< (p, v, a) at a time
};

class TrafficScene {
 public:
  explicit TrafficScene(const TrafficOptions& options);

  static Calibration calibration();
  /// At `t` seconds from the start; frames each .05 s, samples each .005 s, in rising order.
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
