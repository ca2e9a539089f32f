// Integrates the rates of a gyroscope and compares two lists of rotations.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::tools {

class TurnIntegral {
 public:
  /// `samples`: sorted by time; must outlive this object.
  explicit TurnIntegral(const std::vector<ImuSample>& samples);
  /// Whether samples cover the interval without a gap.
  bool covers(TimePoint from, TimePoint to) const;
  /// Orientation of B at a covered time, relative to B at the first sample.
  Eigen::Quaterniond at(TimePoint time) const;
  /// Rotation vector between two covered times.
  Eigen::Vector3d between(TimePoint from, TimePoint to) const;

 private:
  std::size_t after(TimePoint time) const;

  const std::vector<ImuSample>& samples_;
  std::vector<Eigen::Quaterniond> turned_;
  std::vector<int> holes_;  ///< number of gaps before each sample
};

/// Two measurements of the same rotations, without their means, in columns.
struct TurnPairs {
  Eigen::Matrix3Xd reference, given;

  TurnPairs(const std::vector<Eigen::Vector3d>& reference,
            const std::vector<Eigen::Vector3d>& given);
  std::size_t count() const { return static_cast<std::size_t>(reference.cols()); }
  /// RMS of the reference rotations in rad.
  double turning() const;
  double turningOfGiven() const;
  /// Share of the reference that the given rotations, rotated by R, do not explain; 0: all is
  /// explained.
  double unexplained(const Eigen::Matrix3d& R) const;
  /// Disagreement of the two lists: 0 if equal, 1 if uncorrelated, 2 if opposite.
  double disagreement() const { return disagreementBy(Eigen::Matrix3d::Identity()); }
  /// Disagreement of the given rotations after rotation by R.
  double disagreementBy(const Eigen::Matrix3d& R) const;
  /// The R with the smallest unexplained share (Kabsch).
  Eigen::Matrix3d bestRotation() const;
};

}  // namespace perdure::tools
