#include "common/mapping/frames/laid_belief.h"

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {

namespace {

/// Jacobian of an object's state in A with respect to its state in B.
Matrix7d stateTurn(const RigidTransform& T_AB) {
  Matrix7d G = Matrix7d::Identity();
  G.topLeftCorner<3, 3>() = T_AB.R();
  return G;
}

void turn(const RigidTransform& T_AB, const Matrix7d& G, Vector7d& mean, Matrix7d& covariance) {
  mean.head<3>() = (T_AB * Eigen::Vector3d(mean.head<3>())).eval();
  mean[3] = wrapAngle(mean[3] + yawOf(T_AB.R()));
  covariance = (G * covariance * G.transpose()).eval();
  makeSymmetric(covariance);
}

}  // namespace

ObjectBelief turned(const RigidTransform& T_AB, ObjectBelief belief) {
  const Eigen::Matrix3d R = T_AB.R();
  const Matrix7d G = stateTurn(T_AB);
  for (ClassBelief& c : belief.classes) {
    turn(T_AB, G, c.mean, c.covariance);
    c.cross_pose = (G * c.cross_pose).eval();
    c.cross_pose.rightCols<3>() = (c.cross_pose.rightCols<3>() * R.transpose()).eval();
  }
  belief.velocity = R * belief.velocity;
  belief.seen_from = turnedBy(belief.seen_from, yawOf(R));
  return belief;
}

MapObject turned(const RigidTransform& T_AB, MapObject object) {
  turn(T_AB, stateTurn(T_AB), object.mean, object.covariance);
  return object;
}

ObjectBelief relativeToBody(ObjectBelief belief, const Matrix6d& P_pose) {
  for (ClassBelief& c : belief.classes) {
    Matrix7d given = c.covariance - regressOn(P_pose, c.cross_pose) * c.cross_pose.transpose();
    given.diagonal().array() += 1e-6;
    makeSymmetric(given);
    if (isCovariance(given)) c.covariance = given;
    c.cross_pose.setZero();
  }
  return belief;
}

ObjectBelief withFrameError(ObjectBelief belief, const Eigen::Matrix4d& covariance,
                            const Eigen::Vector3d& about) {
  for (ClassBelief& c : belief.classes) {
    const Eigen::Vector3d arm = c.mean.head<3>() - about;
    Eigen::Matrix4d J = Eigen::Matrix4d::Identity();
    J(0, 3) = -arm.y();
    J(1, 3) = arm.x();
    c.covariance.topLeftCorner<4, 4>() += J * covariance * J.transpose();
    makeSymmetric(c.covariance);
  }
  return belief;
}

}  // namespace perdure::mapping
