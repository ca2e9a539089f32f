// The position's deviation has grown by more than a limit in ten seconds, apart from the effect of
// the heading's error.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <deque>

#include "common/base/time.h"
#include "common/types/odometry.h"

namespace perdure::vio {

class PositionDoubt {
 public:
  explicit PositionDoubt(double limit_m) : limit_m_(limit_m) {}

  /// Adds the next pose of the same world; true if its position is uncertain.
  bool add(TimePoint now, const Eigen::Vector3d& p_W, const Matrix9d& covariance) {
    const double sigma = std::sqrt(covariance.block<3, 3>(3, 3).trace());
    while (!before_.empty() && before_.front().time < now - std::chrono::seconds(10)) {
      before_.pop_front();
    }
    before_.push_back({now, p_W, sigma});
    const Pose& then = before_.front();
    const double by_heading =
        std::sqrt(covariance.block<3, 3>(0, 0).trace()) * (p_W - then.p_W).norm();
    return uncertain_ = sigma - then.sigma > limit_m_ + by_heading;
  }
  bool uncertain() const { return uncertain_; }
  void clear() {
    before_.clear();
    uncertain_ = false;
  }

 private:
  double limit_m_;
  struct Pose {
    TimePoint time;
    Eigen::Vector3d p_W;
    double sigma;  ///< m
  };
  std::deque<Pose> before_;
  bool uncertain_ = false;
};

}  // namespace perdure::vio
