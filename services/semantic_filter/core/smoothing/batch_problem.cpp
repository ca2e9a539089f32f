#include "services/semantic_filter/core/smoothing/batch_problem.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/math/dense_kernels.h"
#include "common/math/small_cholesky.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/pose_correlation.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kNoInformation = 1e8;  // px², variance of a side that does not count
constexpr double kYawSpread = 0.8;      // rad, deviation of the yaw prior around the start
constexpr double kAzimuthCorrelation = 0.5;
constexpr double kOtherScale = 1.0;   // deviation that all three log sizes of *other* share
constexpr double kAzimuthTail = 3.0;  // degrees of freedom of the t distribution
constexpr double kAcross = 0.2;   // speed deviation across the length, as a share of that along it
constexpr double kUpwards = 0.2;  // m/s, deviation of the vertical speed

Matrix6d transition(const PoseError& earlier, const PoseError& later) {
  return transitionBetween(earlier.product, later.product).value_or(Matrix6d::Identity());
}

}  // namespace

KeyframeBatch::KeyframeBatch(const Keyframes& keyframes, const PoseError& now)
    : keyframes_(&keyframes) {
  for (const auto& k : keyframes) exact_ = exact_ && k->from->error.covariance.isZero(0.0);
  if (exact_) {
    now_.assign(keyframes.size(), Matrix6d::Zero());
  } else if (!chain(now)) {
    pairUp(now);
  }
}

bool KeyframeBatch::chain(const PoseError& now) {
  constexpr double kLargest = 10.0;
  const auto sane = [](const Matrix6d& m) {
    return m.allFinite() && m.cwiseAbs().maxCoeff() < kLargest;
  };
  const FrameView& first = *keyframes_->front()->from;
  for (const auto& k : *keyframes_) {
    const FrameView& view = *k->from;
    const Matrix6d onto = view.error.product.lazyProduct(first.product_inverse);
    const Matrix6d back = first.error.product.lazyProduct(view.product_inverse);
    const Matrix6d on = now.product.lazyProduct(view.product_inverse);
    if (!sane(onto) || !sane(back) || !sane(on)) {
      onto_.clear(), from_.clear(), now_.clear();
      return false;
    }
    onto_.push_back(onto);
    from_.push_back(back.lazyProduct(view.error.covariance));
    now_.push_back(on.lazyProduct(view.error.covariance));
  }
  return true;
}

void KeyframeBatch::pairUp(const PoseError& now) {
  pairs_.resize(size() * (size() + 1) / 2);
  for (std::size_t j = 0; j < size(); ++j) {
    const PoseError& earlier = (*keyframes_)[j]->from->error;
    for (std::size_t i = j; i < size(); ++i) {
      pairs_[i * (i + 1) / 2 + j] =
          transition(earlier, (*keyframes_)[i]->from->error).lazyProduct(earlier.covariance);
    }
    now_.push_back(transition(earlier, now).lazyProduct(earlier.covariance));
  }
}

void KeyframeBatch::poseCovariance(const ScratchVector<PoseJacobian>& J, SideMatrix& result) const {
  const auto n = static_cast<Eigen::Index>(size());
  result.resize(4 * n, 4 * n);
  if (pairs_.empty()) {
    SideColumns<6> later(4 * n, 6);
    Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, kMostSides> earlier(6, 4 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      later.middleRows<4>(4 * i) = J[k].lazyProduct(onto_[k]);
      earlier.middleCols<4>(4 * i) = from_[k].lazyProduct(J[k].transpose());
    }
    dense::multiplySix(later.data(), earlier.data(), 4 * n, result.data());
    return;
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const auto k = static_cast<std::size_t>(i), l = static_cast<std::size_t>(j);
      const PoseJacobian J_i = J[k].lazyProduct(pairs_[k * (k + 1) / 2 + l]);
      result.block<4, 4>(4 * i, 4 * j) = J_i.lazyProduct(J[l].transpose());
    }
  }
}

BatchProblem::BatchProblem(const KeyframeBatch& batch, const Hypothesis& kind, const State& start,
                           const FrameContext& frame)
    : batch_(batch),
      frame_(frame),
      prior_(frame.priors->of(kind.class_name)),
      size_(sizePriorOf(prior_, kind.upper_part)),
      class_name_(kind.class_name),
      yaw_(start[kYaw]),
      dim_(kind.moving ? kMostFree : kGeometry) {
  // *Other* is initiated with three sizes; here one Gaussian must cover them.
  if (class_name_ == kOtherClass) size_.covariance.array() += kOtherScale * kOtherScale;
  size_information_ = size_.covariance.inverse();
  const auto& box = frame.parameters->box;
  scales_ = biasScales(box);
  heading_ = headingOf(logHeading(start));
  if (!moving()) return;
  const double s2 = std::max(prior_.speed_sigma * prior_.speed_sigma, 0.01);
  const Eigen::Vector3d along(std::cos(yaw_), std::sin(yaw_), 0.0);
  Eigen::Matrix3d P = s2 * along * along.transpose();
  P.diagonal().head<2>().array() += kAcross * kAcross * s2;
  P(2, 2) = kUpwards * kUpwards;
  speed_information_ = P.inverse();
}

State BatchProblem::at(const State& x, const FreeVector& step) const {
  State y = x;
  y.head<kGeometry>() += step.head(kGeometry);
  y[kYaw] = wrapAngle(y[kYaw]);
  if (moving()) y.tail<3>() += step.tail(3);
  return y;
}

std::optional<Stack> BatchProblem::linearise(const State& x) const {
  const auto n = static_cast<Eigen::Index>(batch_.size());
  Stack s;
  s.rows = SideRows::Zero(4 * n, dim_ + 1);
  s.J_pose.assign(batch_.size(), PoseJacobian::Zero());
  s.counts.assign(batch_.size(), {});
  const BoxStyles* styles = nullptr;
  const BoxStyle* style = nullptr;
  for (std::size_t i = 0; i < batch_.size(); ++i) {
    const Keyframe& k = *batch_.keyframes()[i];
    State then = x;
    then.head<3>() -= age(i) * x.tail<3>();
    const BoxStyles* own = &frame_.stylesOf(*k.from);
    if (own != styles) {  // adjacent keyframes mostly have the same network
      styles = own;
      style = &styles->of(class_name_);
    }
    const auto box = projectObserved(then, k.from->projector, *style, heading_);
    if (!box) return std::nullopt;
    const auto use = comparableSides(k.z, *box, k.hidden);
    const auto row = static_cast<Eigen::Index>(4 * i);
    for (int a = 0; a < 4; ++a) {
      const double inside = a < 2 ? box->sides[a] - k.z.sides[a] : k.z.sides[a] - box->sides[a];
      if (!use[a] && !(box->exact[a] && inside > 0.0)) continue;
      s.counts[i][a] = true;
      s.rows(row + a, dim_) = k.z.sides[a] - box->sides[a];
      s.rows.row(row + a).head<kGeometry>() = box->H.row(a).head<kGeometry>();
      if (moving()) s.rows.block<1, 3>(row + a, kGeometry) = -age(i) * box->H.row(a).head<3>();
      s.J_pose[i].row(a) = box->H_pose.row(a);
    }
  }
  if (!s.rows.allFinite()) return std::nullopt;
  return s;
}

void BatchProblem::covariance(const State& x, const Stack& s, SideCovariance& result) const {
  const auto n = static_cast<Eigen::Index>(4 * batch_.size());
  result.own.resize(n, n);
  result.pose.resize(0, 0);
  if (!batch_.exactPoses()) batch_.poseCovariance(s.J_pose, result.pose);
  ScratchVector<ViewRay> rays;
  ScratchVector<Eigen::Vector4d>
      bias_sigma;  // deviations of b, px; 0 for a side that does not count
  rays.reserve(batch_.size());
  bias_sigma.reserve(batch_.size());
  for (std::size_t i = 0; i < batch_.size(); ++i) {
    const Keyframe& k = *batch_.keyframes()[i];
    rays.push_back(viewRayOf(x.head<3>(), k.from->T_WC));
    bias_sigma.push_back(lasting(k).cwiseSqrt());
    for (int side = 0; side < 4; ++side) bias_sigma.back()[side] *= s.counts[i][side] ? 1.0 : 0.0;
  }
  for (std::size_t i = 0; i < batch_.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const double correlation = viewCorrelation(rays[i], rays[j], scales_);
      const auto row = static_cast<Eigen::Index>(4 * i), column = static_cast<Eigen::Index>(4 * j);
      Eigen::Matrix4d own =
          moving() ? acceleration(s, i, j) : Eigen::Matrix4d(Eigen::Matrix4d::Zero());
      own.diagonal() += correlation * bias_sigma[i].cwiseProduct(bias_sigma[j]);
      result.own.block<4, 4>(row, column) = own;
    }
    const Eigen::Vector4d noise_variance = noise(*batch_.keyframes()[i]);
    for (int side = 0; side < 4; ++side) {
      const auto row = static_cast<Eigen::Index>(4 * i) + side;
      result.own(row, row) += s.counts[i][side] ? noise_variance[side] : kNoInformation;
    }
  }
}

Gram gramOf(const SideRows& whitened) {
  const Eigen::Index n = whitened.cols();
  Gram gram(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i <= j; ++i) {
      gram(i, j) = gram(j, i) = whitened.col(i).dot(whitened.col(j));
    }
  }
  return gram;
}

void SideCovariance::factorise(const PerKeyframe& inflations, Cholesky<SideMatrix>& sum) const {
  SideMatrix& R = sum.matrix();
  R.resize(own.rows(), own.cols());
  const Eigen::Index n = own.rows();
  for (Eigen::Index j = 0; j < inflations.size(); ++j) {
    for (Eigen::Index i = j; i < inflations.size(); ++i) {
      const double widening = std::sqrt(inflations[i] * inflations[j]);
      R.block<4, 4>(4 * i, 4 * j) = widening * own.block<4, 4>(4 * i, 4 * j);
    }
    if (pose.size() == 0) continue;
    R.block(4 * j, 4 * j, n - 4 * j, 4) += pose.block(4 * j, 4 * j, n - 4 * j, 4);
  }
  sum.factorise();
}

PerSide SideCovariance::withoutPose(const PerSide& residual, const PerSide& explained) const {
  if (pose.size() == 0) return residual;
  return residual - pose.selfadjointView<Eigen::Lower>() * explained;
}

double SideCovariance::deviation(const PerSide& residual, Eigen::Index keyframe) const {
  Eigen::Matrix4d L = own.block<4, 4>(4 * keyframe, 4 * keyframe);
  Eigen::Vector4d r = residual.segment<4>(4 * keyframe);
  if (!choleskyInPlace(L)) return 0.0;
  whiten(L, r);
  return r.squaredNorm();
}

Quadratic BatchProblem::quadratic(const State& x, const Gram& gram) const {
  Quadratic q{gram.topLeftCorner(dim_, dim_), gram.col(dim_).head(dim_)};
  q.G.block<3, 3>(kSize, kSize) += size_information_;
  q.g.segment<3>(kSize) += size_information_ * (size_.mean - x.segment<3>(kSize));
  const double yaw_information = 1.0 / (kYawSpread * kYawSpread);
  q.G(kYaw, kYaw) += yaw_information;
  q.g[kYaw] += yaw_information * wrapAngle(yaw_ - x[kYaw]);
  if (moving()) {
    q.G.bottomRightCorner<3, 3>() += speed_information_;
    q.g.tail<3>() -= speed_information_ * x.tail<3>();
  }
  addAzimuths(x, q);
  return q;
}

double BatchProblem::priorCost(const State& x) const {
  const Eigen::Vector3d d = size_.mean - x.segment<3>(kSize);
  double cost = d.dot(size_information_ * d) + yawPriorCost(x);
  if (moving()) cost += x.tail<3>().dot(speed_information_ * x.tail<3>());
  return cost;
}

double BatchProblem::yawPriorCost(const State& x) const {
  const double yaw = wrapAngle(yaw_ - x[kYaw]) / kYawSpread;
  return yaw * yaw;
}

double BatchProblem::logAzimuths(const State& x) const {
  double sum = 0.0;
  for (const auto& match : azimuths(x)) sum += std::log(match.likelihood);
  return sum * azimuthWeight();
}

double BatchProblem::logHeading(const State& x) const {
  double sum = 0.0;
  for (const auto& match : azimuths(x)) sum += headingOdds(match);
  return sum * azimuthWeight();
}

ResidualRatio BatchProblem::azimuthResidualRatio(const State& x, double yaw_variance) const {
  const double azimuth_weight = azimuthWeight();
  double squares = 0.0, count = 0.0, information = 0.0;
  for (const auto& k : batch_.keyframes()) {
    if (!prior_.has_yaw || !k->azimuth) continue;
    const double variance = azimuthVariance(*k);
    const auto match = matchAzimuth(*k->azimuth, x, k->from->view, variance + yaw_variance);
    const double share = azimuth_weight * match.inlier;
    squares += share * std::pow(match.residual / azimuthSigma(k->azimuth_sigma, prior_), 2);
    count += share;
    information += share / variance;
  }
  const double free = count - information * yaw_variance;
  return free > 0.0 ? ResidualRatio{squares / free, free} : ResidualRatio{};
}

double BatchProblem::logSpeedPrior() const {
  return moving() ? std::log(speed_information_.determinant()) - 3.0 * std::log(2.0 * M_PI) : 0.0;
}

double BatchProblem::logSizePrior() const { return std::log(size_information_.determinant()); }

double BatchProblem::logVolumeOfCuts(const Stack& s, const PerKeyframe& inflations) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < batch_.size(); ++i) {
    const Keyframe& k = *batch_.keyframes()[i];
    for (int a = 0; a < 4; ++a) {
      const bool cut = !k.z.measured[a] || k.hidden[a];
      if (!cut && s.counts[i][a]) continue;
      const double own = noise(k)[a] + lasting(k)[a];
      sum += std::log(s.counts[i][a] ? own : kNoInformation);
      sum += cut ? std::log(inflations[static_cast<Eigen::Index>(i)]) : -std::log(own);
    }
  }
  return sum;
}

SideColumns<4> BatchProblem::biasNow(const State& x, const Stack& s, const Eigen::Vector4d& sigma,
                                     const PerKeyframe& inflations) const {
  SideColumns<4> c = SideColumns<4>::Zero(s.rows.rows(), 4);
  for (std::size_t i = 0; i < batch_.size(); ++i) {
    const Keyframe& k = *batch_.keyframes()[i];
    const double rho = viewCorrelation(x.head<3>(), k.from->T_WC, frame_.view.T_WC(), scales_);
    for (int a = 0; a < 4; ++a) {
      if (!s.counts[i][a]) continue;
      const auto row = static_cast<Eigen::Index>(4 * i) + a;
      c(row, a) =
          rho * sigma[a] * std::sqrt(lasting(k)[a] * inflations[static_cast<Eigen::Index>(i)]);
    }
  }
  return c;
}

PerSide BatchProblem::noiseOf(const Stack& s, const PerKeyframe& inflations) const {
  PerSide result = PerSide::Zero(s.rows.rows());
  for (std::size_t i = 0; i < batch_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    result.segment<4>(4 * k) = inflations[k] * noise(*batch_.keyframes()[i]);
    for (int a = 0; a < 4; ++a) {
      if (!s.counts[i][a]) result[4 * k + a] = 0.0;
    }
  }
  return result;
}

SideColumns<6> BatchProblem::poseNow(const Stack& s) const {
  SideColumns<6> c(s.rows.rows(), 6);
  for (std::size_t i = 0; i < batch_.size(); ++i) {
    c.middleRows<4>(static_cast<Eigen::Index>(4 * i)) =
        s.J_pose[i].lazyProduct(batch_.poseNow(i).transpose());
  }
  return c;
}

Eigen::Vector4d BatchProblem::noise(const Keyframe& k) const {
  const NoiseScale &then = k.from->noise_scale, &now = frame_.noise_scale;
  return (then.model == now.model ? now.sides.noise / then.sides.noise : 1.0) * k.z.variance;
}

Eigen::Vector4d BatchProblem::lasting(const Keyframe& k) const {
  const NoiseScale &then = k.from->noise_scale, &now = frame_.noise_scale;
  return (then.model == now.model ? now.sides.lasting / then.sides.lasting : 1.0) * k.z.lasting;
}

double BatchProblem::age(std::size_t i) const {
  return moving()
             ? toSeconds(batch_.keyframes().back()->from->time - batch_.keyframes()[i]->from->time)
             : 0.0;
}

Eigen::Matrix4d BatchProblem::acceleration(const Stack& s, std::size_t i, std::size_t j) const {
  const double near = age(i), far = age(j);
  const double q = std::pow(frame_.parameters->motion.acceleration, 2);
  const double variance = q * near * near * (3.0 * far - near) / 6.0;
  return variance *
         s.rows.block<4, 3>(static_cast<Eigen::Index>(4 * i), 0)
             .lazyProduct(s.rows.block<4, 3>(static_cast<Eigen::Index>(4 * j), 0).transpose());
}

ScratchVector<AzimuthMatch> BatchProblem::azimuths(const State& x) const {
  ScratchVector<AzimuthMatch> matches;
  for (const auto& k : batch_.keyframes()) {
    if (!prior_.has_yaw || !k->azimuth) continue;
    matches.push_back(matchAzimuth(*k->azimuth, x, k->from->view, azimuthVariance(*k)));
  }
  return matches;
}

double BatchProblem::azimuthVariance(const Keyframe& k) const {
  const NoiseScale &then = k.from->noise_scale, &now = frame_.noise_scale;
  const double assumed = azimuthSigma(k.azimuth_sigma, prior_);
  return (then.model == now.model ? now : then).azimuth * assumed * assumed;
}

double BatchProblem::azimuthWeight() const {
  const auto count =
      static_cast<double>(std::count_if(batch_.keyframes().begin(), batch_.keyframes().end(),
                                        [](const auto& k) { return k->azimuth.has_value(); }));
  return 1.0 / (1.0 + std::max(count - 1.0, 0.0) * kAzimuthCorrelation);
}

void BatchProblem::addAzimuths(const State& x, Quadratic& q) const {
  const double azimuth_weight = azimuthWeight();
  for (const auto& k : batch_.keyframes()) {
    if (!prior_.has_yaw || !k->azimuth) continue;
    const double variance = azimuthVariance(*k);
    const double residual = matchAzimuth(*k->azimuth, x, k->from->view, variance).residual;
    const double nis = residual * residual / variance;
    const double information =
        azimuth_weight * (kAzimuthTail + 1.0) / (kAzimuthTail + nis) / variance;
    q.G(kYaw, kYaw) += information;
    q.g[kYaw] += information * residual;
  }
}

}  // namespace perdure::semantic_filter
