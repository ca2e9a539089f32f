#include "services/semantic_filter/core/smoother.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/tend.h"

namespace perdure::semantic_filter {
namespace {

constexpr int kRounds = 12;
constexpr double kContradicted = 25.0;  // of about four degrees of freedom

struct Fit {
  State x;
  Stack stack;
  SideCovariance covariance;
  State covariance_at;  ///< the x that it is of
  Eigen::VectorXd doubts;
  Eigen::ArrayXi contradicted;
  Cholesky R;
};

/// Weights of a t distribution for whole looks, and which of them contradict x. Whether the weights
/// changed enough to matter.
bool doubtLooks(Fit& fit, double tail) {
  constexpr double kMatters = 0.05;
  const Eigen::VectorXd residual = fit.covariance.withoutPose(fit.stack.residual, fit.R);
  fit.contradicted.resize(fit.doubts.size());
  bool matters = false;
  for (Eigen::Index i = 0; i < fit.doubts.size(); ++i) {
    const double nis = fit.covariance.deviation(residual, i);
    const auto& counts = fit.stack.counts[static_cast<std::size_t>(i)];
    const auto n = static_cast<double>(std::count(counts.begin(), counts.end(), true));
    const double doubt = std::max(1.0, (tail + nis) / (tail + n));
    matters = matters || std::abs(doubt - fit.doubts[i]) > kMatters * fit.doubts[i];
    fit.doubts[i] = doubt;
    fit.contradicted[i] = nis > kContradicted ? 1 : 0;
  }
  return matters;
}

/// The covariance changes little with x: it is taken anew where the thing has moved in the view.
bool movedInView(const Fit& fit, const Eigen::Vector3d& from) {
  constexpr double kLittle = 0.02, kLittleTurn = 0.05;  // of the distance; rad
  const double distance = (fit.x.head<3>() - from).norm();
  return (fit.x - fit.covariance_at).head<3>().norm() > kLittle * distance ||
         std::abs(wrapAngle(fit.x[kYaw] - fit.covariance_at[kYaw])) > kLittleTurn ||
         (fit.x - fit.covariance_at).segment<3>(kSize).cwiseAbs().maxCoeff() > kLittleTurn;
}

bool factorise(const BatchModel& model, Fit& fit, bool anew) {
  if (anew) {
    fit.covariance = model.covariance(fit.x, fit.stack);
    fit.covariance_at = fit.x;
  }
  fit.R = Cholesky(fit.covariance.with(fit.doubts));
  return fit.R.positive();
}

/// One step of Levenberg and Marquardt's. False where none lowers the cost.
bool descend(const BatchModel& model, Fit& fit, double& damping, double& moved) {
  const Eigen::MatrixXd Jw = fit.R.whiten(fit.stack.J);
  const Eigen::VectorXd rw = fit.R.whiten(fit.stack.residual);
  const Quadratic q = model.quadratic(fit.x, Jw, rw);
  const double cost = rw.squaredNorm() + model.priorCost(fit.x);
  for (int attempt = 0; attempt < 6; ++attempt) {
    FreeMatrix damped = q.G;
    damped.diagonal() *= 1.0 + damping;
    const FreeVector step = solveSymmetric(damped, q.g);
    const State next = model.at(fit.x, step);
    auto stack = step.allFinite() ? model.linearise(next) : std::nullopt;
    if (stack) {
      const Eigen::VectorXd w = fit.R.whiten(stack->residual);
      if (w.squaredNorm() + model.priorCost(next) <= cost * (1.0 + 1e-3) + 1e-6) {
        moved = step.head<3>().norm();
        fit.x = next;
        fit.stack = std::move(*stack);
        damping = std::max(0.1 * damping, 1e-6);
        return true;
      }
    }
    damping *= 10.0;
  }
  return false;
}

std::optional<Fit> fitLooks(const BatchModel& model, const State& start, const Looks& looks,
                            double tail) {
  Fit fit;
  fit.x = start;
  fit.doubts = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(looks.size()));
  auto stack = model.linearise(fit.x);
  if (!stack) return std::nullopt;
  fit.stack = std::move(*stack);
  if (!factorise(model, fit, true)) return std::nullopt;
  const Eigen::Vector3d from = looks.keyframes().back()->from->T_WC.p;
  double damping = 1e-4;
  for (int round = 0; round < kRounds; ++round) {
    double moved = 0.0;
    const bool better = descend(model, fit, damping, moved);
    const bool doubted = doubtLooks(fit, tail);
    const bool elsewhere = movedInView(fit, from);
    if ((doubted || elsewhere) && !factorise(model, fit, elsewhere)) return std::nullopt;
    if (round > 0 && (!better || moved < 0.005)) break;
  }
  return fit;
}

/// The filter's state, with b and C, from the fit.
std::optional<Hypothesis> stateOf(const BatchModel& model, const Fit& fit, const Hypothesis& start,
                                  const FrameContext& frame) {
  const Eigen::MatrixXd Jw = fit.R.whiten(fit.stack.J);
  const Eigen::VectorXd rw = fit.R.whiten(fit.stack.residual);
  const Cholesky information(model.quadratic(fit.x, Jw, rw).G);
  if (!information.positive()) return std::nullopt;
  const Eigen::MatrixXd P = information.solve(Eigen::MatrixXd::Identity(model.dim(), model.dim()));
  const double distance = (fit.x.head<3>() - frame.view.T_WC().p).norm();
  if (!P.allFinite()) return std::nullopt;
  const auto now = projectCuboid(fit.x, frame.view);
  if (!now) return std::nullopt;
  const Eigen::Vector4d sigma =
      biasSigma(viewWalkOf(frame).lasting, std::max(now->sides[2] - now->sides[0], 1.0),
                std::max(now->sides[3] - now->sides[1], 1.0))
          .cwiseMax(1e-6);
  const Eigen::MatrixXd Bw =
      fit.R.whiten(model.biasNow(fit.x, fit.stack, sigma, fit.doubts).transpose());
  const Eigen::MatrixXd Ew = fit.R.whiten(model.poseNow(fit.stack).transpose());
  const Eigen::MatrixXd BJ = Bw.transpose() * Jw;
  const Eigen::MatrixXd C = -P * (Jw.transpose() * Ew);

  // State order: geometry, b, velocity.
  const int g = kGeometry;
  Hypothesis h = start;
  h.moving = model.moving();
  h.x = fit.x;
  h.x.segment<4>(kBias) = Bw.transpose() * rw;
  h.P.setZero();
  h.P.topLeftCorner(g, g) = P.topLeftCorner(g, g);
  h.P.block<4, 4>(kBias, kBias) = -Bw.transpose() * Bw + BJ * P * BJ.transpose();
  h.P.block<4, 4>(kBias, kBias).diagonal() += sigma.cwiseAbs2();
  const Eigen::MatrixXd cross = -BJ * P;
  h.P.block(kBias, 0, 4, g) = cross.leftCols(g);
  h.P.block(0, kBias, g, 4) = cross.leftCols(g).transpose();
  h.C.setZero();
  h.C.topRows(g) = C.topRows(g);
  h.C.middleRows<4>(kBias) = -Bw.transpose() * Ew - BJ * C;
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
  if (placeSigma(h, frame.pose_error.covariance) > frame.parameters->smooth.place * distance) {
    return std::nullopt;
  }
  return h;
}

}  // namespace

std::optional<Smoothed> Smoothed::make(const Hypothesis& start, const Looks& looks,
                                       const FrameContext& frame) {
  const BatchModel model(looks, start.moving, start.class_name, start.x[kYaw], frame);
  State x = start.x;
  x.segment<4>(kBias).setZero();
  const auto fit = fitLooks(model, x, looks, frame.parameters->box.tail);
  if (!fit) return std::nullopt;
  const auto h = stateOf(model, *fit, start, frame);
  if (!h) return std::nullopt;
  Smoothed result(looks, frame);
  result.hypothesis_ = *h;
  result.doubts_ = fit->doubts;
  result.contradicted_ = fit->contradicted;
  result.start_yaw_ = start.x[kYaw];
  return result;
}

double Smoothed::logEvidence(const Eigen::VectorXd& doubts) const {
  constexpr double kImpossible = -1e6;
  const BatchModel model(*looks_, hypothesis_.moving, hypothesis_.class_name, start_yaw_, *frame_);
  State x = hypothesis_.x;
  x.segment<4>(kBias).setZero();
  const auto s = model.linearise(x);
  if (!s) return kImpossible;
  const Cholesky R(model.covariance(x, *s).with(doubts));
  if (!R.positive()) return kImpossible;
  const Eigen::MatrixXd Jw = R.whiten(s->J);
  const Eigen::VectorXd rw = R.whiten(s->residual);
  const Quadratic q = model.quadratic(x, Jw, rw);
  const Cholesky G(q.G);
  if (!G.positive()) return kImpossible;
  const double cost = rw.squaredNorm() + model.priorCost(x) - G.whiten(q.g).squaredNorm();
  const double free = (model.dim() - kGeometry) * std::log(2.0 * M_PI);
  return 0.5 * (free + model.logSpeedPrior() - cost - R.logDeterminant() - G.logDeterminant());
}

namespace {

/// The thing at rest where the looks say, when the filter has come to believe that it moves.
Hypothesis atRest(const Hypothesis& moving, const Keyframes& keyframes) {
  Hypothesis h = moving;
  const double age =
      toSeconds(keyframes.back()->from->time - keyframes[keyframes.size() / 2]->from->time);
  h.x.head<3>() -= age * h.x.tail<3>();
  h.x.tail<3>().setZero();
  h.moving = false;
  h.head = moving.head;
  h.weight = 0.0;
  return h;
}

/// Of one class: whether it moves, by what all looks say.
void weighMotion(std::vector<Hypothesis>& hs, const std::string& name, const Smoothed& still,
                 const Smoothed& moving, const FrameContext& frame) {
  constexpr double kSurest = 15.0;  // nats
  const ClassPrior& prior = frame.priors->of(name);
  const auto& motion = frame.parameters->motion;
  const Eigen::VectorXd doubts = still.doubts().cwiseMin(moving.doubts());
  const double pace =
      motion.creeping + (1.0 - motion.creeping) *
                            fasterThan(moving.hypothesis(), motion.slow_share * prior.speed_sigma);
  const double log_odds = std::clamp(still.logEvidence(doubts) - moving.logEvidence(doubts) +
                                         std::log((1.0 - prior.moving) / prior.moving / pace),
                                     -kSurest, kSurest);
  const double rests = 1.0 / (1.0 + std::exp(-log_odds));
  double weight[2] = {0.0, 0.0};
  for (const auto& h : hs) {
    if (h.class_name == name) weight[h.moving] += h.weight;
  }
  const double all = weight[0] + weight[1];
  for (auto& h : hs) {
    if (h.class_name != name || weight[h.moving] <= 0.0) continue;
    h.weight *= all * (h.moving ? 1.0 - rests : rests) / weight[h.moving];
    if (h.moving) h.pace = pace;
  }
}

/// What the fits that were taken say of each look.
struct Verdicts {
  int fits = 0;
  Eigen::ArrayXi against;
  void add(const Eigen::ArrayXi& contradictions) {
    against = fits++ == 0 ? contradictions : Eigen::ArrayXi(against + contradictions);
  }
};

/// A look that contradicts every fit showed something else.
void forgetContradicted(Object& object, const Verdicts& verdicts, std::size_t least) {
  if (verdicts.fits == 0) return;
  std::vector<std::shared_ptr<const Keyframe>> kept;
  for (std::size_t i = 0; i < object.keyframes.size(); ++i) {
    if (verdicts.against[static_cast<Eigen::Index>(i)] < verdicts.fits) {
      kept.push_back(object.keyframes[i]);
    }
  }
  if (kept.size() >= least) object.keyframes = std::move(kept);
}

void smoothClass(Object& object, const std::string& name, const Looks& looks,
                 const FrameContext& frame, Verdicts& verdicts) {
  const auto& p = frame.parameters->smooth;
  std::optional<Smoothed> best[2];  // at rest, moving
  double weight[2] = {0.0, 0.0};
  for (auto& h : object.hypotheses) {
    if (h.class_name != name || h.weight < p.least_weight) continue;
    auto smoothed = Smoothed::make(h, looks, frame);
    if (!smoothed || smoothed->contradicted() > p.contradicted) continue;
    const double old = h.weight;
    h = smoothed->hypothesis();
    verdicts.add(smoothed->contradictions());
    if (old > weight[h.moving]) weight[h.moving] = old, best[h.moving] = std::move(smoothed);
  }
  if (!best[1]) return;
  if (!best[0]) {
    auto smoothed = Smoothed::make(atRest(best[1]->hypothesis(), object.keyframes), looks, frame);
    if (!smoothed || smoothed->contradicted() > p.contradicted) return;
    object.hypotheses.push_back(smoothed->hypothesis());
    object.hypotheses.back().weight = 1e-3 * weight[1];
    best[0] = std::move(smoothed);
  }
  weighMotion(object.hypotheses, name, *best[0], *best[1], frame);
}

}  // namespace

bool rememberLook(Object& object, const Evidence& box, const std::array<bool, 4>& hidden,
                  const FrameContext& frame) {
  const auto& p = *frame.parameters;
  if (p.smooth.keyframes == 0 || !frame.key_view || !object.remembers_all) return false;
  const ViewScales scales{p.box.bias_angle, p.box.bias_log_distance, p.box.bias_image_angle};
  Keyframe keyframe{frame.key_view, box.z, hidden, box.azimuth, box.azimuth_sigma};
  if (!remember(object, std::move(keyframe), scales, p.smooth)) return false;
  if (object.keyframes.size() < static_cast<std::size_t>(p.smooth.least)) return false;
  ++object.fresh_keyframes;
  return smoothingNeed(object) >= 1.0;
}

double smoothingNeed(const Object& object) {
  // One look more among many changes little: an eighth of them is waited for, and more where the
  // last fits had little to mend.
  return 8.0 * object.fresh_keyframes /
         (static_cast<double>(object.keyframes.size()) * object.smoothing_patience);
}

void smooth(Object& object, const FrameContext& frame) {
  const auto most_patience = static_cast<std::uint32_t>(frame.parameters->smooth.patience);
  constexpr double kLittle = 1.0;  // squared deviations, of seven dimensions
  const auto& p = *frame.parameters;
  object.fresh_keyframes = 0;
  const Hypothesis before = object.best();
  const Looks looks(object.keyframes);
  std::set<std::string> names;
  for (const auto& h : object.hypotheses) names.insert(h.class_name);
  Verdicts verdicts;
  for (const auto& name : names) smoothClass(object, name, looks, frame, verdicts);
  forgetContradicted(object, verdicts, static_cast<std::size_t>(p.smooth.least));
  normalise(object, ClassEvidence::kMotion);
  const bool same =
      before.class_name == object.best().class_name && before.moving == object.best().moving;
  const bool settled = same && distance2(before, object.best()) < kLittle;
  object.smoothing_patience = settled ? std::min(2 * object.smoothing_patience, most_patience) : 1;
}

}  // namespace perdure::semantic_filter
