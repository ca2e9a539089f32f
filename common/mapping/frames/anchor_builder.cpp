#include "common/mapping/frames/anchor_builder.h"

#include <cmath>

namespace perdure::mapping {
namespace {
constexpr double kDeadBandMetres = 0.02;
/// Least distance between anchors, also after a turn or with an uncertain yaw.
constexpr double kLeastMetres = 1.0;
}  // namespace

void AnchorBuilder::resume(const Anchor& last) {
  last_ = last;
  way_m_ = last.way_m;
  counted_W_ = last.T_WA.p;
  since_ = LevelGaussian{};
  before_.emplace();
  before_->stamp = last.stamp;
  before_->T_WB = last.T_WA;
  before_->up_W = last.T_WA.R().col(2);
  error_.begin(*before_);
}

std::optional<Anchor> AnchorBuilder::add(const Odometry& odometry, AnchorId next) {
  if (odometry.state == OdometryState::kInitialising) return std::nullopt;
  if (!last_) return setAnchor(odometry, next);
  const double metres = countWay(odometry.T_WB.p);
  error_.add(*before_, odometry, metres);
  before_ = odometry;
  const RigidTransform T_AW = last_->T_WA.inverse();
  since_->mean = levelOf(T_AW * levelled(odometry.T_WB, odometry.up_W));
  Eigen::Matrix4d J = Eigen::Matrix4d::Identity();
  J.topLeftCorner<3, 3>() = T_AW.R();
  since_->covariance = J * error_.covariance() * J.transpose();
  if (metres == 0.0 || !isDue()) return std::nullopt;
  return setAnchor(odometry, next);
}

double AnchorBuilder::countWay(const Eigen::Vector3d& p_W) {
  const double metres = (p_W - counted_W_).norm();
  if (metres < kDeadBandMetres) return 0.0;
  counted_W_ = p_W;
  way_m_ += metres;
  return metres;
}

bool AnchorBuilder::isDue() const {
  const double metres = way_m_ - last_->way_m;
  if (metres >= parameters_.distance_m) return true;
  return metres > kLeastMetres && (std::abs(since_->mean.yaw) >= parameters_.turn_rad ||
                                   std::sqrt(since_->covariance(3, 3)) > parameters_.yaw_sigma_rad);
}

Anchor AnchorBuilder::setAnchor(const Odometry& odometry, AnchorId id) {
  Anchor anchor;
  anchor.id = id;
  anchor.previous = last_ ? last_->id : 0;
  anchor.session = odometry.world;
  anchor.stamp = odometry.stamp;
  anchor.T_WA = levelled(odometry.T_WB, odometry.up_W);
  if (since_) anchor.from_previous = *since_;
  anchor.way_m = way_m_;
  if (!last_) counted_W_ = odometry.T_WB.p;
  last_ = anchor;
  since_ = LevelGaussian{};
  before_ = odometry;
  error_.begin(odometry);
  return anchor;
}

}  // namespace perdure::mapping
