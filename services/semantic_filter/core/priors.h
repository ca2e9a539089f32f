// What is known of a class before any image: size, how well it is detected, whether it moves.
// The paper's class-dependent shape prior (section "Filter Organization").
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace perdure::semantic_filter {

struct ClassPrior {
  std::string name;                                    ///< lower-case
  Eigen::Vector3d log_size = Eigen::Vector3d::Zero();  ///< mean of log(l, w, h), log metres
  Eigen::Matrix3d log_size_covariance = Eigen::Matrix3d::Identity();
  double frequency = 1.0;              ///< relative to other classes, > 0
  double detection_probability = 0.8;  ///< of a fully visible, large instance; (0, 1)
  double moving = 0.0;                 ///< prior probability that an instance moves, [0, 1)
  double speed_sigma = 0.0;            ///< of moving ones, along their length, m/s
  bool has_yaw = true;                 ///< false: too round for its yaw to show in a box
  double azimuth_sigma = 0.35;         ///< radians, floor of what a network's azimuth deserves
};

/// Priors by name, with a documented fallback for names that are not listed.
struct ClassPriors {
  std::vector<ClassPrior> classes;
  ClassPrior fallback;  ///< broad; its name is empty
  ClassPrior other;     ///< of a thing of no known class; its name is kOtherClass

  ClassPrior of(const std::string& name) const {
    for (const auto& c : classes) {
      if (c.name == name) return c;
    }
    if (name == other.name) return other;
    ClassPrior c = fallback;
    c.name = name;
    return c;
  }
};

}  // namespace perdure::semantic_filter
