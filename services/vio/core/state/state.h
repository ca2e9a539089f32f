// State of the filter: navigation, camera-IMU calibration, a window of past poses and points, and
// the joint covariance of their errors. Paper, eq. 3; MSCKF: Mourikis & Roumeliotis, ICRA 2007.
// Order of the error: nav [θ, p, v, b_g, b_a]; [θ_BC, p_BC, lens, read-out] of each camera, the
// last two if estimated; time offset; gyroscope scale if estimated; then clones and points in order
// of insertion. Rotation errors are right multiplied, R = R̂ Exp(θ).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/base/time.h"
#include "common/math/gaussian.h"
#include "common/math/rigid_transform.h"
#include "services/vio/core/state/lens_error.h"
#include "services/vio/core/state/row_motion.h"

namespace perdure::vio {

struct Nav {
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();

  RigidTransform T_WB() const { return RigidTransform(q_WB, p_WB); }
};

/// Pose of the body at an image. `linear` is the linearisation point, copied from nav_linear.
struct Clone {
  std::uint64_t frame = 0;
  TimePoint image_time;
  RigidTransform T_WB, linear;
  int at = 0;                               ///< index of the clone's error
  RowMotion rows;                           ///< used only for rolling shutters
  SharedCameras cameras;                    ///< TrackedFrame::cameras
  std::array<LensError, kMaxCameras> lens;  ///< of these cameras
};

struct PointState {
  std::uint64_t id = 0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero(), linear = Eigen::Vector3d::Zero();
  int at = 0;
  int failed_gates = 0;
};

/// Position of a block of a Jacobian's columns in the error state.
struct Block {
  int at = 0, size = 0;
};

/// r = H·error + noise of unit covariance, with the columns of `blocks`; a non-owning view.
struct Measurement {
  MatrixView H;
  std::span<const Block> blocks;
  VectorView r;
};

/// Memory for matrices that is reused, so that a running filter does not allocate. It is not
/// copied.
class Workspace {
 public:
  using Matrix = Eigen::Map<Eigen::MatrixXd, Eigen::Aligned16>;

  Workspace() = default;
  Workspace(const Workspace&) {}
  Workspace& operator=(const Workspace&) { return *this; }

  /// Reserves room for `size` numbers in total. Matrices taken earlier become invalid.
  void begin(Eigen::Index size) {
    if (memory_.size() < size) memory_.resize(size);
    taken_ = 0;
  }
  /// Returns the number of begin()'s numbers that a matrix takes.
  static Eigen::Index need(Eigen::Index rows, Eigen::Index columns) {
    return (rows * columns + 1) / 2 * 2;
  }
  /// Returns a matrix with undefined elements.
  Matrix take(Eigen::Index rows, Eigen::Index columns);

 private:
  Eigen::VectorXd memory_;
  Eigen::Index taken_ = 0;
};

inline constexpr int kNavSize = 15, kScaleSize = 3;
inline constexpr int kTheta = 0, kPosition = 3, kVelocity = 6, kGyroBias = 9, kAccelBias = 12;

/// Calibration values that are part of the error, besides extrinsics and time offset.
struct Estimated {
  bool readout = false;  ///< of cameras whose read-out time is not 0
  bool scale = false;    ///< of the gyroscope
  bool lens = false;     ///< of each camera

  bool operator==(const Estimated&) const = default;
};

/// Returns the size of the error without clones and points. readout_s is the read-out time of each
/// camera.
int calibrationSize(const std::vector<double>& readout_s, const Estimated& estimated);

class State {
 public:
  /// readout_s is the read-out time of each camera, 0 for a global shutter; empty if all are
  /// global.
  State(const std::vector<RigidTransform>& T_BC, double time_offset_s, int max_clones,
        int max_points, const std::vector<double>& readout_s = {}, const Estimated& estimated = {});

  /// nav_linear is the linearisation point: the predicted q, and a p and v that updates do not
  /// change.
  Nav nav, nav_linear;
  TimePoint time;                    ///< IMU clock
  std::vector<RigidTransform> T_BC;  ///< pose of each camera in B
  double time_offset_s = 0.0;        ///< t_imu = t_image + time_offset_s
  std::vector<double> readout_s;     ///< s from first to last row of each camera; 0: global shutter
  std::vector<LensError> lens;       ///< of each camera; 0 if not estimated
  /// Ratio, for each axis, of a reading without bias to the true rate.
  Eigen::Vector3d gyro_scale = Eigen::Vector3d::Ones();
  std::vector<Clone> clones;  ///< oldest first
  std::vector<PointState> points;

  int size() const { return size_; }
  /// Returns the errors of a camera, which begin with its extrinsics.
  Block camera(std::size_t c) const { return {cameras_[c], cameras_[c + 1] - cameras_[c]}; }
  /// Returns the index of the error of a camera's lens; nothing if it is not estimated.
  std::optional<int> lensAt(std::size_t c) const {
    return estimated_.lens ? std::optional(cameras_[c] + 6) : std::nullopt;
  }
  /// Returns the index of the error of a camera's read-out; nothing if it is not estimated.
  std::optional<int> readoutAt(std::size_t c) const {
    return estimated_.readout && rolls(c) ? std::optional(cameras_[c + 1] - 1) : std::nullopt;
  }
  int timeOffsetAt() const { return cameras_[T_BC.size()]; }
  /// Returns the number of errors of all cameras.
  int camerasSize() const { return timeOffsetAt() - kNavSize; }
  /// Returns the index of the error of the gyroscope's scale; nothing if it is not estimated.
  std::optional<int> scaleAt() const {
    return estimated_.scale ? std::optional(timeOffsetAt() + 1) : std::nullopt;
  }
  /// Returns the size of the error without clones and points.
  int calibrationEnd() const { return timeOffsetAt() + 1 + (estimated_.scale ? kScaleSize : 0); }
  bool rolls(std::size_t c) const { return rolls_[c]; }
  /// Returns the longest read-out of all cameras, in s; 0 if none has a rolling shutter.
  double longestReadout() const {
    double longest = 0.0;  // an estimate may be negative
    for (const double s : readout_s) longest = std::max(longest, std::abs(s));
    return longest;
  }
  /// Returns the camera at the time at which it exposed `row`: −½ … ½ from the first to the last
  /// row.
  RowCamera rowCamera(const Clone& clone, std::size_t camera, double row) const {
    return vio::rowCamera(clone.rows, T_BC[camera], row * readout_s[camera]);
  }
  auto P() { return P_.topLeftCorner(size_, size_); }
  auto P() const { return P_.topLeftCorner(size_, size_); }

  const Clone* clone(std::uint64_t frame) const;
  const PointState* point(std::uint64_t id) const;

  /// Adds a clone of the current pose. The body's rate rate_B, in rad/s, gives its correlation with
  /// the time offset.
  void addClone(std::uint64_t frame, TimePoint image_time, const Eigen::Vector3d& rate_B,
                bool first_estimates, SharedCameras cameras = {});
  /// Adds an error to the pose of the rig on the body, which all cameras share. The deviations are
  /// in rad and m.
  void widenMount(double rotation, double position_m);
  /// Enlarges the covariance of the current pose and of the newest clone, which must be the same
  /// pose. The deviations are in rad about the body's axes and in m along those of W.
  void widenPose(double rotation, double position_m);
  /// Adds a common error with deviation sigma_m along each axis to all positions.
  void widenPositions(double sigma_m);
  void removeClone(std::uint64_t frame);
  /// Adds a point with its covariance, and its cross-covariance with the state (3 × size()).
  void addPoint(std::uint64_t id, const Eigen::Vector3d& p_W, const Eigen::Matrix3d& covariance,
                const Eigen::MatrixXd& cross);
  void removePoint(std::uint64_t id);

  /// x ← x ⊞ dx.
  void apply(const VectorView& dx);
  /// EKF update with r = H·error + noise of unit covariance; H has the columns of `blocks`. Fails
  /// with "update_not_positive" or "update_not_finite"; the state is then unchanged.
  Result<void> update(const Eigen::MatrixXd& H, const std::vector<Block>& blocks,
                      const Eigen::VectorXd& r);
  /// Updates in the same way with several measurements. Each has only the columns of its own few
  /// blocks.
  Result<void> update(std::span<const Measurement> measurements);
  /// Returns H P Hᵀ for an H with the columns of `blocks`.
  Eigen::MatrixXd project(const MatrixView& H, std::span<const Block> blocks) const;
  Eigen::MatrixXd covarianceOf(std::span<const Block> blocks) const;
  Eigen::MatrixXd covarianceOf(std::initializer_list<Block> blocks) const {
    return covarianceOf(std::span(blocks.begin(), blocks.size()));
  }
  /// Returns true if all numbers are finite and all variances are positive.
  bool healthy() const;

 private:
  int append(int size);
  void remove(int at, int size);

  Estimated estimated_;
  std::array<bool, kMaxCameras> rolls_{};
  std::array<int, kMaxCameras + 1> cameras_;  ///< index of the errors of each camera; then the end
  int size_;
  Eigen::MatrixXd P_;  ///< allocated to capacity; only the upper left size_ × size_ block is valid
  Workspace workspace_;
};

}  // namespace perdure::vio
