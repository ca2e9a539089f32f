#include "services/semantic_filter/core/smoothing/map_fit.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/pose_correlation.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

constexpr int kRounds = 12;
constexpr double kEnough = 0.02;  // least gain of a further step, squared deviations

struct MapFit::Fit {
  State x;
  Stack stack;
  std::shared_ptr<SideCovariance> covariance;  ///< fits of the same batch share it
  State covariance_at;                         ///< the x at which the covariance was computed
  PerKeyframe inflations;
  KeyframeCounts contradicted;
  std::shared_ptr<Cholesky<SideMatrix>> R;
  SideRows whitened;  ///< L⁻¹ times the rows of the stack, R = L Lᵀ

  double squaredResidual() const { return whitened.rightCols<1>().squaredNorm(); }
};

namespace {

using Fit = MapFit::Fit;

/// Sets inflation and contradiction of each keyframe. Returns whether an inflation changed much.
bool inflateKeyframes(Fit& fit, double tail) {
  constexpr double kMatters = 0.1;
  const PerSide residual = fit.covariance->withoutPose(
      fit.stack.residual(), fit.R->unwhiten(fit.whitened.rightCols<1>()));
  fit.contradicted.resize(fit.inflations.size());
  bool matters = false;
  for (Eigen::Index i = 0; i < fit.inflations.size(); ++i) {
    const double nis = fit.covariance->deviation(residual, i);
    const auto& counts = fit.stack.counts[static_cast<std::size_t>(i)];
    const auto n = static_cast<double>(std::count(counts.begin(), counts.end(), true));
    const double inflation = std::max(1.0, (tail + nis) / (tail + n));
    matters = matters || std::abs(inflation - fit.inflations[i]) > kMatters * fit.inflations[i];
    fit.inflations[i] = inflation;
    fit.contradicted[i] = nis > gates::kContradiction ? 1 : 0;
  }
  return matters;
}

/// Whether the object has moved so far that the covariance must be computed again.
bool movedInView(const Fit& fit, const Eigen::Vector3d& from) {
  constexpr double kLittle = 0.02;  // of the distance
  const double distance = (fit.x.head<3>() - from).norm();
  return (fit.x - fit.covariance_at).head<3>().norm() > kLittle * distance;
}

/// Returns a value that no other fit shares. If it was not shared, its memory is reused.
template <class T>
T& ownOf(std::shared_ptr<T>& shared) {
  if (!shared || shared.use_count() > 1) {
    shared = std::allocate_shared_for_overwrite<T>(ScratchAllocator<T>());
  }
  return *shared;
}

bool factorise(const BatchProblem& model, Fit& fit, bool anew) {
  if (anew) {
    model.covariance(fit.x, fit.stack, ownOf(fit.covariance));
    fit.covariance_at = fit.x;
  }
  fit.covariance->factorise(fit.inflations, ownOf(fit.R));
  if (!fit.R->positive()) return false;
  fit.whitened = fit.R->whiten(fit.stack.rows);
  return true;
}

/// Damping of Levenberg-Marquardt steps. It falls by the ratio of true to predicted gain (Nielsen
/// 1999). The cost has a kink at a change of the extreme corner. If the damping fell after each
/// success, every other step would fail there.
class Damping {
 public:
  double value() const { return value_; }
  void failed() { value_ = std::max(5.0 * value_, kEffective); }
  void succeeded(double share) {
    value_ = std::max(value_ * std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * share - 1.0, 3)), 1e-6);
  }

 private:
  static constexpr double kEffective = 0.03;  // a smaller damping hardly changes a step
  double value_ = 1e-4;
};

/// Takes one step and sets its predicted gain (squared deviations). Returns false if no step lowers
/// the cost.
bool descend(const BatchProblem& model, Fit& fit, Damping& damping, double& predicted_gain) {
  const Quadratic q = model.quadratic(fit.x, gramOf(fit.whitened));
  const double cost = fit.squaredResidual() + model.priorCost(fit.x);
  for (int attempt = 0; attempt < 6; ++attempt) {
    FreeMatrix damped = q.G;
    damped.diagonal() *= 1.0 + damping.value();
    const Cholesky information(damped);
    const FreeVector step =
        information.positive() ? information.solve(q.g) : FreeVector(FreeVector::Zero(model.dim()));
    const State next = model.at(fit.x, step);
    auto stack = information.positive() && step.allFinite() ? model.linearise(next) : std::nullopt;
    if (stack) {
      auto whitened = fit.R->whiten(stack->rows);
      const double then = whitened.rightCols<1>().squaredNorm() + model.priorCost(next);
      if (then <= cost * (1.0 + 1e-3) + 1e-6) {
        predicted_gain = q.g.dot(step);
        fit.x = next;
        fit.stack = std::move(*stack);
        fit.whitened = std::move(whitened);
        damping.succeeded(predicted_gain > 1e-9 ? (cost - then) / predicted_gain : 1.0);
        return true;
      }
    }
    damping.failed();
  }
  return false;
}

/// Returns the widened covariance of b in all rows, for an object at rest. `noise`: widened; 0 for
/// a side that does not count.
SideMatrix lastingPart(const Fit& fit, const PerSide& noise) {
  SideMatrix part = fit.covariance->own.selfadjointView<Eigen::Lower>();
  for (Eigen::Index j = 0; j < fit.inflations.size(); ++j) {
    for (Eigen::Index i = 0; i < fit.inflations.size(); ++i) {
      part.block<4, 4>(4 * i, 4 * j) *= std::sqrt(fit.inflations[i] * fit.inflations[j]);
    }
  }
  part.diagonal() -= noise;
  for (Eigen::Index row = 0; row < noise.size(); ++row) {
    if (noise[row] == 0.0) part(row, row) = 0.0;
  }
  return part;
}

bool isOneOf(const ScratchVector<const Hypothesis*>& found, const State& x) {
  return std::any_of(found.begin(), found.end(), [&](const Hypothesis* mode) {
    Hypothesis h = *mode;
    h.x = x;
    return distance2(*mode, h) < gates::kSameFit;
  });
}

/// Returns the fit from `start`; nothing if it fails or reaches one of the modes `found`. `like`:
/// fit of another mode of the batch, whose covariance and inflations this fit begins with.
std::optional<Fit> fitKeyframes(const BatchProblem& model, const State& start,
                                const KeyframeBatch& batch, double tail, const Fit* like,
                                const ScratchVector<const Hypothesis*>& found) {
  Fit fit;
  fit.x = start;
  fit.inflations = PerKeyframe::Ones(static_cast<Eigen::Index>(batch.size()));
  auto stack = model.linearise(fit.x);
  if (!stack) return std::nullopt;
  fit.stack = std::move(*stack);
  if (like && like->stack.counts == fit.stack.counts) {
    fit.covariance = like->covariance;
    fit.covariance_at = like->covariance_at;
    fit.inflations = like->inflations;
    fit.R = like->R;
    fit.whitened = fit.R->whiten(fit.stack.rows);
  } else if (!factorise(model, fit, true)) {
    return std::nullopt;
  }
  const Eigen::Vector3d from = batch.keyframes().back()->from->T_WC.p;
  Damping damping;
  double before = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    double predicted_gain = 0.0;
    const bool better = descend(model, fit, damping, predicted_gain);
    if (isOneOf(found, fit.x)) return std::nullopt;
    const bool inflated = inflateKeyframes(fit, tail);
    const bool elsewhere = movedInView(fit, from);
    if ((inflated || elsewhere) && !factorise(model, fit, elsewhere)) return std::nullopt;
    if (round > 0 && (!better || predicted_gain < kEnough)) break;
    const bool converges = !inflated && !elsewhere && predicted_gain < 0.5 * before;
    if (round > 0 && converges && predicted_gain * predicted_gain < kEnough * before) break;
    before = predicted_gain;
  }
  return fit;
}

/// Returns the hypothesis of the fit, with b and C for the filter.
std::optional<Hypothesis> stateOf(const BatchProblem& model, const Fit& fit,
                                  const Hypothesis& start, const FrameContext& frame) {
  const auto Jw = fit.whitened.leftCols(model.dim());
  const auto rw = fit.whitened.rightCols<1>();
  const Cholesky information(model.quadratic(fit.x, gramOf(fit.whitened)).G);
  if (!information.positive()) return std::nullopt;
  const FreeMatrix P = information.solve(FreeMatrix::Identity(model.dim(), model.dim()));
  const double distance = (fit.x.head<3>() - frame.view.T_WC().p).norm();
  if (!P.allFinite()) return std::nullopt;
  const auto now = projectCuboid(fit.x, frame.projector());
  if (!now) return std::nullopt;
  const Eigen::Vector4d sigma =
      biasSigma(viewWalkOf(frame).lasting, std::max(now->sides[2] - now->sides[0], 1.0),
                std::max(now->sides[3] - now->sides[1], 1.0))
          .cwiseMax(1e-6);
  using FreeColumns = Eigen::Matrix<double, Eigen::Dynamic, 6, 0, kMostFree, 6>;
  using FourFree = Eigen::Matrix<double, 4, Eigen::Dynamic, 0, 4, kMostFree>;
  const auto Bw = fit.R->whiten(model.biasNow(fit.x, fit.stack, sigma, fit.inflations));
  const auto Ew = fit.R->whiten(model.poseNow(fit.stack));
  // The factors are tall and narrow, so packing them for Eigen's product costs more than the sums.
  const FourFree BJ = Bw.transpose().lazyProduct(Jw);
  const FreeColumns C = -P.lazyProduct(Jw.transpose().lazyProduct(Ew).eval());

  // State order: geometry, b, velocity.
  const int g = kGeometry;
  Hypothesis h = start;
  h.moving = model.moving();
  h.x = fit.x;
  h.x.segment<4>(kBias) = Bw.transpose().lazyProduct(rw);
  h.P.setZero();
  h.P.topLeftCorner(g, g) = P.topLeftCorner(g, g);
  h.P.block<4, 4>(kBias, kBias) =
      BJ.lazyProduct(P.lazyProduct(BJ.transpose()).eval()) - Bw.transpose().lazyProduct(Bw);
  h.P.block<4, 4>(kBias, kBias).diagonal() += sigma.cwiseAbs2();
  const FourFree cross = -BJ.lazyProduct(P);
  h.P.block(kBias, 0, 4, g) = cross.leftCols(g);
  h.P.block(0, kBias, g, 4) = cross.leftCols(g).transpose();
  h.C.setZero();
  h.C.topRows(g) = C.topRows(g);
  h.C.middleRows<4>(kBias) = -Bw.transpose().lazyProduct(Ew) - BJ.lazyProduct(C);
  if (model.moving()) {
    h.P.bottomRightCorner<3, 3>() = P.bottomRightCorner<3, 3>();
    h.P.block(kVelocity, 0, 3, g) = P.bottomLeftCorner(3, g);
    h.P.block(0, kVelocity, g, 3) = P.topRightCorner(g, 3);
    h.P.block<3, 4>(kVelocity, kBias) = cross.rightCols<3>().transpose();
    h.P.block<4, 3>(kBias, kVelocity) = cross.rightCols<3>();
    h.C.bottomRows<3>() = C.bottomRows(3);
  }
  makeSymmetric(h.P);
  const int n = model.moving() ? kStateDim : kVelocity;
  if (!h.x.allFinite() || !isCovariance(h.P.topLeftCorner(n, n))) return std::nullopt;
  if (placeSigma(h, frame.pose_error.covariance) > frame.parameters->smoothing.place * distance) {
    return std::nullopt;
  }
  return h;
}

}  // namespace

std::optional<MapFit> MapFit::make(const Hypothesis& start, const KeyframeBatch& batch,
                                   const FrameContext& frame, const MapFit* like,
                                   const ScratchVector<const Hypothesis*>& found) {
  const BatchProblem model(batch, start, start.x, frame);
  State x = start.x;
  x.segment<4>(kBias).setZero();
  auto fit = fitKeyframes(model, x, batch, frame.parameters->box.tail,
                          like ? like->fit_.get() : nullptr, found);
  if (!fit) return std::nullopt;
  auto h = stateOf(model, *fit, start, frame);
  if (!h) return std::nullopt;
  // With R of another state, a common motion of object and pose would seem observed.
  if (fit->covariance_at != fit->x && !isJointCovariance(*h, frame.pose_error.covariance)) {
    h = factorise(model, *fit, true) ? stateOf(model, *fit, start, frame) : std::nullopt;
    if (!h) return std::nullopt;
  }
  MapFit result(batch, frame);
  result.hypothesis_ = *h;
  result.start_ = start.x;
  result.fit_ = std::allocate_shared<const Fit>(ScratchAllocator<Fit>(), std::move(*fit));
  return result;
}

BatchProblem MapFit::modelOf() const { return {*batch_, hypothesis_, start_, *frame_}; }

const KeyframeCounts& MapFit::contradictions() const { return fit_->contradicted; }

std::size_t MapFit::sides() const {
  std::size_t sum = 0;
  for (const auto& counts : fit_->stack.counts) {
    sum += static_cast<std::size_t>(std::count(counts.begin(), counts.end(), true));
  }
  return sum;
}

SideEvidence MapFit::sideEvidence() const {
  // Robust weights, at most one, leave this share of a squared four-dimensional residual.
  constexpr double kShareAfterWeights = 0.83;
  constexpr double kMost = 9.0;  // times the expected squares; one fit must not decide alone
  const BatchProblem model = modelOf();
  Fit fit = *fit_;
  // At another state other sides count, so the parts would not add up to R.
  if (fit.covariance_at != fit.x && !factorise(model, fit, true)) return {};
  const SideRows J = fit.whitened.leftCols(model.dim());
  const Cholesky G(model.quadratic(fit.x, gramOf(fit.whitened)).G);
  if (!G.positive()) return {};
  const SideRows r = fit.whitened.rightCols<1>();
  // The two parts of R = noise + lasting + pose that have a scale.
  const PerSide noise = model.noiseOf(fit.stack, fit.inflations);
  SideMatrix parts[2] = {noise.asDiagonal(), lastingPart(fit, noise)};
  SideEvidence evidence;
  for (int c = 0; c < 2; ++c) {
    const SideMatrix M = fit.R->whiten(fit.R->whiten(parts[c]).transpose().eval());
    const double squares = (M * r).cwiseProduct(r).sum() / kShareAfterWeights;
    // Removes the part that the estimate of the geometry explains: Q M, with Q = I - J G⁻¹ Jᵀ.
    parts[c] = M - J * G.solve((J.transpose() * M).eval());
    const double expected = parts[c].trace();
    evidence.gradient[c] = std::min(squares, kMost * expected) - expected;
  }
  for (int c = 0; c < 2; ++c) {
    for (int d = 0; d < 2; ++d) {
      evidence.information(c, d) = parts[c].cwiseProduct(parts[d].transpose()).sum();
    }
  }
  return evidence;
}

ResidualRatio MapFit::azimuthResidualRatio() const {
  return modelOf().azimuthResidualRatio(fit_->x, hypothesis_.P(kYaw, kYaw));
}

double MapFit::logHeading() const { return modelOf().logHeading(fit_->x); }

double MapFit::logEvidence(bool of_yaw) const {
  constexpr double kImpossible = -1e6;
  const PerKeyframe& inflations = fit_->inflations;
  const BatchProblem model = modelOf();
  const Stack& stack = fit_->stack;
  // R must be of exactly this state, on which its determinant of a hundred dimensions depends.
  thread_local SideCovariance covariance;
  model.covariance(fit_->x, stack, covariance);
  thread_local Cholesky<SideMatrix> R;
  covariance.factorise(inflations, R);
  if (!R.positive()) return kImpossible;
  const Gram gram = gramOf(R.whiten(stack.rows));
  const Quadratic q = model.quadratic(fit_->x, gram);
  const Cholesky G(q.G);
  if (!G.positive()) return kImpossible;
  const double cost =
      gram(model.dim(), model.dim()) + model.priorCost(fit_->x) - G.whiten(q.g).squaredNorm();
  const double free = (model.dim() - kGeometry) * std::log(2.0 * M_PI);
  const double yaw = of_yaw ? model.logAzimuths(fit_->x) + 0.5 * model.yawPriorCost(fit_->x) : 0.0;
  const double volume = R.logDeterminant() - model.logVolumeOfCuts(stack, inflations);
  const double priors = model.logSpeedPrior() + model.logSizePrior();
  // A t distribution is a Gaussian whose inflation has an inverse gamma distribution.
  const double tail = frame_->parameters->box.tail *
                      (inflations.array().log() + inflations.array().inverse() - 1.0).sum();
  return yaw + 0.5 * (free + priors - cost - tail - volume - G.logDeterminant());
}

}  // namespace perdure::semantic_filter
