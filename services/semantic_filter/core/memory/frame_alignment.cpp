#include "services/semantic_filter/core/memory/frame_alignment.h"

#include <algorithm>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::semantic_filter {
namespace {

Eigen::Matrix4d rotated(const Eigen::Matrix4d& covariance, const Eigen::Matrix3d& R) {
  Eigen::Matrix4d G = Eigen::Matrix4d::Identity();
  G.topLeftCorner<3, 3>() = R;
  return G * covariance * G.transpose();
}

/// d[p_W, yaw_W] of an object at `arm` (in W, from the middle) by d[middle, yaw].
Eigen::Matrix4d jacobianAt(const Eigen::Vector3d& arm) {
  Eigen::Matrix4d J = Eigen::Matrix4d::Identity();
  J(0, 3) = -arm.y();
  J(1, 3) = arm.x();
  return J;
}

}  // namespace

PlacedThing placedOf(const ObjectBelief& belief) {
  PlacedThing thing;
  thing.id = belief.id;
  thing.p = belief.best().mean.head<3>();
  thing.yaw = belief.best().mean[kYaw];
  thing.covariance = belief.best().covariance.topLeftCorner<4, 4>();
  for (const auto& c : belief.classes) thing.pmf.push_back({c.name, c.probability});
  return thing;
}

Eigen::Vector3d FrameAlignment::operator*(const Eigen::Vector3d& p_M) const {
  return rotationAboutZ(yaw) * p_M + p;
}

FrameAlignment alignmentAt(const LevelPose& x, const Eigen::Vector3d& about_M) {
  FrameAlignment alignment;
  alignment.yaw = wrapAngle(x[3]);
  alignment.about_M = about_M;
  alignment.p = x.head<3>() - rotationAboutZ(x[3]) * about_M;
  return alignment;
}

double wrapHalfTurn(double angle) { return 0.5 * wrapAngle(2.0 * angle); }

void AlignmentEquations::add(const PlacedThing& seen, const PlacedThing& thing,
                             const Eigen::Vector3d& about_M, const LevelPose& x, double weight,
                             double blur) {
  const Eigen::Matrix3d R = rotationAboutZ(x[3]);
  const Eigen::Vector3d arm = R * (thing.p - about_M);
  Eigen::Vector4d residual;
  residual << seen.p - (x.head<3>() + arm), wrapHalfTurn(seen.yaw - thing.yaw - x[3]);
  Eigen::Matrix4d S = seen.covariance + rotated(thing.covariance, R);
  S.diagonal().head<3>().array() += blur * blur;
  const Eigen::Matrix4d W = inverseSymmetric(S);
  const Eigen::Matrix4d J = jacobianAt(arm);
  information += weight * J.transpose() * W * J;
  pull += weight * J.transpose() * W * residual;
  chi2 += weight * residual.dot(W * residual);
  weights += weight;
}

LevelPose AlignmentEquations::step() const { return inverseSymmetric(information) * pull; }

Eigen::Matrix4d AlignmentEquations::covariance() const {
  const double freedom = 4.0 * weights - 4.0;
  const double scale = freedom > 0.0 ? std::max(1.0, chi2 / freedom) : 1.0;
  return scale * inverseSymmetric(information);
}

FrameAlignment refined(const FrameAlignment& start,
                       const std::vector<std::pair<PlacedThing, PlacedThing>>& pairs) {
  if (pairs.size() < 3) return start;
  Eigen::Vector3d middle_M = Eigen::Vector3d::Zero();
  for (const auto& [thing, seen] : pairs) middle_M += thing.p / static_cast<double>(pairs.size());
  LevelPose x;
  x << start * middle_M, start.yaw;
  AlignmentEquations last;
  for (int i = 0; i < 3; ++i) {
    last = {};
    for (const auto& [thing, seen] : pairs) last.add(seen, thing, middle_M, x);
    x += last.step();
  }
  FrameAlignment result = alignmentAt(x, middle_M);
  result.covariance = last.covariance();
  result.nats = start.nats;
  result.next_nats = start.next_nats;
  return result;
}

ObjectBelief laidInto(const FrameAlignment& alignment, ObjectBelief belief) {
  const Eigen::Matrix3d R = rotationAboutZ(alignment.yaw);
  belief = turned(RigidTransform(R, alignment.p), std::move(belief));
  const Eigen::Vector3d middle = alignment * alignment.about_M;
  for (ClassBelief& c : belief.classes) {
    const Eigen::Matrix4d J = jacobianAt(c.mean.head<3>() - middle);
    c.covariance.topLeftCorner<4, 4>() += J * alignment.covariance * J.transpose();
    makeSymmetric(c.covariance);
    c.cross_pose.setZero();
  }
  return belief;
}

}  // namespace perdure::semantic_filter
