// Prior of a class before any image: size, frequency, detection probability and motion. It
// implements the paper's class-dependent shape prior (section "Filter Organization"). Derivation:
// tools/docs/maths/state_and_mixture.md.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "services/semantic_filter/core/belief/classes/shape.h"

namespace perdure::semantic_filter {

struct ClassPrior {
  std::string name;                                    ///< lower-case
  Eigen::Vector3d log_size = Eigen::Vector3d::Zero();  ///< mean of log(l, w, h), log metres
  Eigen::Matrix3d log_size_covariance = Eigen::Matrix3d::Identity();
  double frequency = 1.0;              ///< relative to other classes, > 0
  double detection_probability = 0.8;  ///< of a fully visible, large object; (0, 1)
  double moving = 0.0;       ///< prior probability that an object of the class moves, [0, 1)
  double speed_sigma = 0.0;  ///< of moving objects, along their length, m/s
  double stands = 0.0;       ///< probability that an object stands on the ground, [0, 1)
  bool has_yaw = true;       ///< false: the object is so round that a box does not show its yaw
  /// rad; least standard deviation of an azimuth, until a smaller one is learned
  double azimuth_sigma = 0.35;
  Shape shape = cuboidShape();  ///< the part of the cuboid that the object fills
};

/// Priors by class name, with a fallback for names that are not listed.
struct ClassPriors {
  std::vector<ClassPrior> classes;
  ClassPrior fallback;  ///< broad; its name is empty
  ClassPrior other;     ///< of an object of no known class; its name is kOtherClass

  /// Returns `other` for kOtherClass, and the fallback for names that are not listed.
  const ClassPrior& of(const std::string& name) const {
    for (const auto& c : classes) {
      if (c.name == name) return c;
    }
    return name == other.name ? other : fallback;
  }
};

}  // namespace perdure::semantic_filter
