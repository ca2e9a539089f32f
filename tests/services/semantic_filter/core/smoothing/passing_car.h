// Keyframes of a car that the body passes.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "services/semantic_filter/core/smoothing/keyframes.h"
#include "services/semantic_filter/core/smoothing/map_fit.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter::testing {

inline State parkedCar() { return makeState(32.0, 5.0, 0.8, 0.15, 4.3, 1.8, 1.45); }

/// A car (or an object that moves like one) that the body passes. Its boxes are drawn from the
/// model of the estimate. `seen`: the cuboid of its visible part.
class Passing {
 public:
  explicit Passing(unsigned seed, double speed = 0.0, double pose_sigma = 0.0,
                   const State& seen = parkedCar())
      : camera_(makeCamera()), random_(seed), priors_(makePriors()), truth_(seen) {
    for (auto& c : priors_.classes) c.moving = 0.2, c.speed_sigma = 8.0, c.stands = 0.97;
    parameters_.smoothing.new_view = 0.01;
    truth_[kVelocity] = speed;
    shift_ = Eigen::Vector3d(normal_(random_), normal_(random_), normal_(random_)) * pose_sigma;
    error_.covariance.bottomRightCorner<3, 3>().diagonal().setConstant(pose_sigma * pose_sigma);
    error_.covariance.topLeftCorner<3, 3>().diagonal().setConstant(1e-8);
    for (int k = 0; k < 18; ++k) look(k);
  }

  FrameContext frame() const {
    const auto& last = *keyframes_.back()->from;
    return {last.view, last.error, nullptr, &priors_, &parameters_, keyframes_.back()->from};
  }
  const Keyframes& keyframes() const { return keyframes_; }
  Keyframes& keyframes() { return keyframes_; }
  const State& truth() const { return truth_; }  ///< true state at the last keyframe
  Parameters& parameters() { return parameters_; }

  /// A hypothesis as after a bad first box.
  Hypothesis start(bool moving) const {
    Hypothesis h;
    h.class_name = "car";
    h.moving = moving;
    h.weight = 1.0;
    h.x = truth_;
    h.x.tail<3>().setZero();
    h.x.head<3>() += Eigen::Vector3d(4.0, 0.6, 0.1);
    h.x.segment<3>(kSize).array() += 0.12;
    return h;
  }

 private:
  void look(int k) {
    const double t = 0.2 * k;
    RigidTransform believed;
    believed.p = Eigen::Vector3d(1.4 * k, 0.0, 1.2);
    RigidTransform true_pose = believed;
    true_pose.p += shift_;
    State x = truth_;
    x.head<3>() += t * truth_.tail<3>();
    const View seen{&camera_, true_pose, Eigen::Vector3d::UnitZ()};
    const auto box = projectObserved(x, seen, BoxStyle());
    if (!box) return;
    const double width = box->sides[2] - box->sides[0], height = box->sides[3] - box->sides[1];
    Keyframe keyframe;
    const Box b{box->sides[0], box->sides[1], box->sides[2], box->sides[3]};
    keyframe.z = measure(b, camera_.width(), camera_.height(), parameters_.box, {});
    for (int i = 0; i < 4; ++i) {  // b: one draw for all keyframes, in shares of the box
      const double size = i % 2 == 0 ? width : height;
      if (k == 0) bias_[i] = normal_(random_);
      keyframe.z.sides[i] += std::sqrt(keyframe.z.variance[i]) * normal_(random_) +
                             0.5 * std::sqrt(keyframe.z.lasting[i]) * bias_[i];
      EXPECT_GT(size, 0.0);
    }
    keyframe.from = std::make_shared<const FrameView>(
        View{&camera_, believed, seen.up_W}, error_, fromNanoseconds(std::int64_t{200'000'000} * k),
        std::make_shared<const BoxStyles>());
    keyframes_.push_back(std::make_shared<const Keyframe>(keyframe));
    if (k == 17) truth_.head<3>() += t * truth_.tail<3>();
  }

  CameraModel camera_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  ClassPriors priors_;
  Parameters parameters_;
  State truth_;
  Eigen::Vector3d shift_;
  PoseError error_;
  Eigen::Vector4d bias_ = Eigen::Vector4d::Zero();
  Keyframes keyframes_;
};

}  // namespace perdure::semantic_filter::testing
