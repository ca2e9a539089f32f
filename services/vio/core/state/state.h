// The filter's state: navigation, camera-IMU calibration, a window of past poses and points, and
// the joint covariance of their errors. Paper, eq. 3; MSCKF: Mourikis & Roumeliotis, ICRA 2007.
// Order of the error: nav [θ, p, v, b_g, b_a], per camera [θ_BC, p_BC], time offset, read-outs and
// gyroscope scale where they are estimated, then clones and points in the order in which they came.
// Rotations err on the right, R = R̂ Exp(θ).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/base/time.h"
#include "common/math/gaussian.h"
#include "common/math/rigid_transform.h"
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

/// The body's pose at an image. `linear`: where Jacobians are taken, on nav_linear's path.
struct Clone {
  std::uint64_t frame = 0;
  TimePoint image_time;
  RigidTransform T_WB, linear;
  int at = 0;      ///< where its error begins
  RowMotion rows;  ///< of use where a shutter rolls
};

struct PointState {
  std::uint64_t id = 0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero(), linear = Eigen::Vector3d::Zero();
  int at = 0;
  int failed_gates = 0;
};

/// Where a block of columns of a Jacobian lies in the error.
struct Block {
  int at = 0, size = 0;
};

/// r = H·error + noise of unit covariance; H's columns are those of `blocks`, one after another.
/// A view: the owner of the numbers must outlive it.
struct Measurement {
  MatrixView H;
  std::span<const Block> blocks;
  VectorView r;
};

/// Memory for matrices that are needed for a moment: it grows to the largest need and is kept, so
/// that a filter that runs allocates nothing. No part of a value: copies begin without any.
class Workspace {
 public:
  using Matrix = Eigen::Map<Eigen::MatrixXd, Eigen::Aligned16>;

  Workspace() = default;
  Workspace(const Workspace&) {}
  Workspace& operator=(const Workspace&) { return *this; }

  /// Room for `size` numbers in all; what was taken before is void.
  void begin(Eigen::Index size) {
    if (memory_.size() < size) memory_.resize(size);
    taken_ = 0;
  }
  /// How much of begin()'s room a matrix takes.
  static Eigen::Index need(Eigen::Index rows, Eigen::Index columns) {
    return (rows * columns + 1) / 2 * 2;
  }
  /// Not initialised.
  Matrix take(Eigen::Index rows, Eigen::Index columns);

 private:
  Eigen::VectorXd memory_;
  Eigen::Index taken_ = 0;
};

inline constexpr int kNavSize = 15, kScaleSize = 3;
inline constexpr int kTheta = 0, kPosition = 3, kVelocity = 6, kGyroBias = 9, kAccelBias = 12;

class State {
 public:
  /// readout_s: of each camera, 0 where all rows are exposed at once; none given: all are. Those
  /// that are not 0 are in the error where estimate_readout says so, the gyroscope's scale where
  /// estimate_scale does.
  State(const std::vector<RigidTransform>& T_BC, double time_offset_s, int max_clones,
        int max_points, const std::vector<double>& readout_s = {}, bool estimate_readout = false,
        bool estimate_scale = false);

  /// nav_linear: q as predicted, p and v on a path that no update moves: where Jacobians are taken.
  Nav nav, nav_linear;
  TimePoint time;                    ///< IMU clock
  std::vector<RigidTransform> T_BC;  ///< one for each camera
  double time_offset_s = 0.0;        ///< t_imu = t_image + time_offset_s
  std::vector<double> readout_s;     ///< of each camera: first to last row; 0: all at once
  /// Of each axis: a reading without its bias is so many times the rate.
  Eigen::Vector3d gyro_scale = Eigen::Vector3d::Ones();
  std::vector<Clone> clones;  ///< oldest first
  std::vector<PointState> points;

  int size() const { return size_; }
  int extrinsicsAt(int camera) const { return kNavSize + 6 * camera; }
  int timeOffsetAt() const { return kNavSize + 6 * static_cast<int>(T_BC.size()); }
  /// Where the error of a camera's read-out is; nothing where that is not estimated.
  std::optional<int> readoutAt(std::size_t camera) const;
  int readoutCount() const;
  /// Where the error of the gyroscope's scale is; nothing where that is not estimated.
  std::optional<int> scaleAt() const {
    return estimates_scale_ ? std::optional(timeOffsetAt() + 1 + readoutCount()) : std::nullopt;
  }
  /// What comes before clones and points.
  int calibrationEnd() const {
    return timeOffsetAt() + 1 + readoutCount() + (estimates_scale_ ? kScaleSize : 0);
  }
  bool rolls(std::size_t camera) const { return readout_s[camera] != 0.0; }
  /// Of all cameras; 0 where none rolls.
  double longestReadout() const {
    double longest = 0.0;  // an estimate may be below 0
    for (const double s : readout_s) longest = std::max(longest, std::abs(s));
    return longest;
  }
  /// The camera when it saw a row. `row`: −½ … ½, first to last.
  RowCamera rowCamera(const Clone& clone, std::size_t camera, double row) const {
    return vio::rowCamera(clone.rows, T_BC[camera], row * readout_s[camera]);
  }
  auto P() { return P_.topLeftCorner(size_, size_); }
  auto P() const { return P_.topLeftCorner(size_, size_); }

  const Clone* clone(std::uint64_t frame) const;
  const PointState* point(std::uint64_t id) const;

  /// Adds a clone of the present pose. rate_B: angular rate, which ties it to the time offset.
  void addClone(std::uint64_t frame, TimePoint image_time, const Eigen::Vector3d& rate_B,
                bool first_estimates);
  /// Adds to the covariance of the present pose, and of the newest clone, which is the same.
  /// Deviations in rad and m, about the body's and along the world's axes.
  void widenPose(double rotation, double position_m);
  void removeClone(std::uint64_t frame);
  /// Adds a point with its covariance and its cross-covariance (3 × size()).
  void addPoint(std::uint64_t id, const Eigen::Vector3d& p_W, const Eigen::Matrix3d& covariance,
                const Eigen::MatrixXd& cross);
  void removePoint(std::uint64_t id);

  /// x ← x ⊞ dx.
  void apply(const VectorView& dx);
  /// EKF update with residual r = H·error + noise of unit covariance; H's columns are those of
  /// `blocks`, one after another. Fails with "update_not_positive" or "update_not_finite", and
  /// then leaves the state as it was.
  Result<void> update(const Eigen::MatrixXd& H, const std::vector<Block>& blocks,
                      const Eigen::VectorXd& r);
  /// The same with measurements that each touch few blocks: their zeros cost nothing.
  Result<void> update(std::span<const Measurement> measurements);
  /// H P Hᵀ for such an H.
  Eigen::MatrixXd project(const MatrixView& H, std::span<const Block> blocks) const;
  /// The covariance of the error of `blocks`.
  Eigen::MatrixXd covarianceOf(std::span<const Block> blocks) const;
  Eigen::MatrixXd covarianceOf(std::initializer_list<Block> blocks) const {
    return covarianceOf(std::span(blocks.begin(), blocks.size()));
  }
  /// All numbers finite and all variances positive.
  bool healthy() const;

 private:
  int append(int size);
  void remove(int at, int size);

  std::vector<int> readout_at_;  ///< of each camera; −1: not estimated
  bool estimates_scale_;
  int size_;
  Eigen::MatrixXd P_;  ///< capacity; the upper left size_ × size_ counts
  Workspace workspace_;
};

}  // namespace perdure::vio
