// The rotation that a gyroscope's rates add up to, and how well two lists of turns agree.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::tools {

class TurnIntegral {
 public:
  /// `samples` by time; must outlive this.
  explicit TurnIntegral(const std::vector<ImuSample>& samples);
  /// Samples reach from one to the other without a hole.
  bool covers(TimePoint from, TimePoint to) const;
  /// Orientation of B at a time that is covered, in B at the first sample.
  Eigen::Quaterniond at(TimePoint time) const;
  /// Rotation vector from one time to the other, both covered.
  Eigen::Vector3d between(TimePoint from, TimePoint to) const;

 private:
  std::size_t after(TimePoint time) const;

  const std::vector<ImuSample>& samples_;
  std::vector<Eigen::Quaterniond> turned_;
  std::vector<int> holes_;  ///< before each sample
};

/// Two measurements of the same turns, without their means, in columns.
struct TurnPairs {
  Eigen::Matrix3Xd reference, given;

  TurnPairs(const std::vector<Eigen::Vector3d>& reference,
            const std::vector<Eigen::Vector3d>& given);
  std::size_t count() const { return static_cast<std::size_t>(reference.cols()); }
  /// Root of the mean square, rad: of the reference, and of those given.
  double turning() const;
  double turningOfGiven() const;
  /// Share of the reference that those given, turned by R, leave unexplained: 0 where all is
  /// explained.
  double unexplained(const Eigen::Matrix3d& R) const;
  /// 0: they are the same; 1: one has nothing to do with the other; 2: they are opposite.
  double disagreement() const { return disagreementBy(Eigen::Matrix3d::Identity()); }
  /// Of those given, turned by R.
  double disagreementBy(const Eigen::Matrix3d& R) const;
  /// The R that leaves least (Kabsch).
  Eigen::Matrix3d bestRotation() const;
};

}  // namespace perdure::tools
