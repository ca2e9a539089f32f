// What is known of a class before any image: size, how well it is detected, whether it moves.
// The paper's class-dependent shape prior (section "Filter Organization").
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <string>
#include <vector>

#include "services/semantic_filter/core/belief/shape.h"

namespace perdure::semantic_filter {

struct ClassPrior {
  std::string name;                                    ///< lower-case
  Eigen::Vector3d log_size = Eigen::Vector3d::Zero();  ///< mean of log(l, w, h), log metres
  Eigen::Matrix3d log_size_covariance = Eigen::Matrix3d::Identity();
  double frequency = 1.0;              ///< relative to other classes, > 0
  double detection_probability = 0.8;  ///< of a fully visible, large instance; (0, 1)
  double moving = 0.0;                 ///< prior probability that an instance moves, [0, 1)
  double speed_sigma = 0.0;            ///< of moving ones, along their length, m/s
  double stands = 0.0;          ///< probability that an instance stands on the ground, [0, 1)
  bool has_yaw = true;          ///< false: too round for its yaw to show in a box
  double azimuth_sigma = 0.35;  ///< radians, at least, until azimuths have shown less
  Shape shape = cuboidShape();  ///< what its things fill of their cuboids
};

/// How often things of two classes stand near each other, learned from maps (core/context.h).
struct ContextMatrix {
  double radius_m = 0.0;             ///< what is further away is not near
  std::vector<std::string> classes;  ///< empty: no context
  Eigen::MatrixXd log_ratio;         ///< log P(a near b) / (P(a) P(b)); symmetric, as `classes`

  bool empty() const { return classes.empty(); }
  /// 0 for classes that it does not name.
  double of(const std::string& a, const std::string& b) const {
    const auto i = std::find(classes.begin(), classes.end(), a) - classes.begin();
    const auto j = std::find(classes.begin(), classes.end(), b) - classes.begin();
    return i < log_ratio.rows() && j < log_ratio.cols() ? log_ratio(i, j) : 0.0;
  }
};

/// Priors by name, with a documented fallback for names that are not listed.
struct ClassPriors {
  std::vector<ClassPrior> classes;
  ClassPrior fallback;  ///< broad; its name is empty
  ClassPrior other;     ///< of a thing of no known class; its name is kOtherClass
  ContextMatrix context;

  /// The fallback, whose name is empty, where there is none of that name.
  const ClassPrior& of(const std::string& name) const {
    for (const auto& c : classes) {
      if (c.name == name) return c;
    }
    return name == other.name ? other : fallback;
  }
};

}  // namespace perdure::semantic_filter
