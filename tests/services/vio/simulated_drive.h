// A seeded drive with exact truth for the tests: an analytic trajectory, an IMU with noise and
// bias, and a point cloud in the images of one or two cameras with pixel noise.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/math/rigid_transform.h"
#include "services/vio/core/estimator.h"
#include "services/vio/core/propagation/imu_buffer.h"

namespace perdure::vio::test {

/// The trajectory: through a room of 12 × 12 × 6 m, along a street at a constant 8.5 m/s, or a
/// rotation on the spot in the middle of the room.
enum class DrivePlace { kRoom, kStreet, kSpot };

struct DriveOptions {
  DrivePlace place = DrivePlace::kRoom;
  unsigned seed = 1;
  double imu_rate_hz = 200.0, camera_rate_hz = 20.0;
  ImuNoise noise;
  double pixel_sigma = 0.4;
  bool stereo = false;
  double camera_ahead_m = 0.0;  ///< relative to testCamera
  bool walking_biases = false;  ///< random walks by the noise; call imu() before truth()
  double time_offset_s = 0.0;   ///< true t_imu − t_image
  double readout_s = 0.0;       ///< true, of a rolling shutter: first to last row
  double rest_s = 0.0;          ///< time at rest at the start
  double spot_radius_m = 0.0;   ///< motion on the spot: radius of the body's circle
  double spot_pace = 1.0;       ///< motion on the spot: factor on the angular rates
  int points = 600;             ///< motion on a street: number of points per 150 m
  int points_per_image = 100;
  /// Motion of the world that the cameras see, during this interval of their clock.
  RigidTransform jump;
  double jump_from_s = 1e9, jump_until_s = 1e9;
  RigidTransform mount;  ///< motion of the cameras on the body, from mount_from_s on
  double mount_from_s = 1e9;
  Eigen::Vector3d gyro_bias{0.01, -0.02, 0.015}, accel_bias{0.05, -0.03, 0.02};
  Eigen::Vector3d gyro_scale = Eigen::Vector3d::Ones();  ///< reading without bias, divided by the
                                                         ///< rate
};

class SimulatedDrive {
 public:
  explicit SimulatedDrive(const DriveOptions& options);

  /// Truth at a time of the IMU clock, in seconds from the start.
  Nav truth(double t) const;
  Eigen::Vector3d rateTruth(double t) const;
  /// Specific force in B without bias.
  Eigen::Vector3d forceTruth(double t) const;

  TimePoint time(double t) const { return fromNanoseconds(1'000'000'000) + durationFromSeconds(t); }
  /// Returns all samples in [0, until].
  std::vector<ImuReading> imu(double until);
  /// Returns the body's pose that the images show: the truth, apart from jump and mount.
  RigidTransform seenFrom(double t) const;
  /// Returns the pixel of a point in camera `c` at image time `t`, with each row at its own time.
  std::optional<Eigen::Vector2d> project(std::size_t c, const Eigen::Vector3d& p_W, double t) const;
  /// Returns the tracked points of the cameras at image time `t` (their clock).
  TrackedFrame see(double t);
  Eigen::Vector2d pixelOf(std::size_t point, double t) const;

  /// The calibration of the cameras has the true read-out time.
  const std::vector<CameraModel>& cameras() const { return cameras_; }
  std::vector<RigidTransform> T_BC() const;
  const std::vector<Eigen::Vector3d>& points() const { return points_; }

 private:
  void buildRoom();
  void buildStreet();
  double phase(double t) const;
  Eigen::Vector3d position(double t) const;
  Eigen::Matrix3d rotation(double t) const;
  Eigen::Vector3d noise(double sigma);

  DriveOptions options_;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> biases_;  ///< biases at each sample
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::vector<CameraModel> cameras_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<std::uint64_t> ids_;  ///< 0: not tracked at present
  std::uint64_t next_id_ = 1;
};

/// Returns a seeded image of 752 × 480 with corners everywhere.
cv::Mat texture(unsigned seed);

/// Returns the image moved by (dx, dy) pixels; its border is reflected.
cv::Mat shifted(const cv::Mat& image, double dx, double dy);

/// Returns the truth at `t` with errors drawn from the returned covariance; yaw and position are
/// exact. `scale` applies to all deviations (1: 10 mrad of tilt, 0.05 m/s, 5 mrad/s, 0.05 m/s²).
Start startAt(const SimulatedDrive& drive, double t, unsigned seed, double scale);

/// Returns a camera similar to EuRoC's that looks along body z; index 1 is 11 cm beside index 0.
CameraCalibration testCamera(int index);

}  // namespace perdure::vio::test
