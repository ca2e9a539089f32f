#include "tools/calibrate/motion/joint.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "common/base/algorithms/median.h"
#include "common/math/so3.h"
#include "tools/calibrate/motion/joint_residual.h"

namespace perdure::calibrate {
namespace {

using namespace joint;

/// Normal equations of one window by the last N of the shared unknowns, after the elimination of
/// its corners. The last kOwn of these are the window's own.
template <int N>
struct Reduced {
  Eigen::Matrix<double, N, N> H = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 1> g = Eigen::Matrix<double, N, 1>::Zero();  ///< of half the cost
  std::vector<Eigen::Matrix<double, N + 1, 1>> rows;  ///< for each corner: coupling, information
  std::vector<double> pulls;                          ///< gradients of the inverse depths
};

/// The same after the elimination of the window's own unknowns as well.
struct Joint {
  JointMatrix H;
  JointVector g;
};

/// The weight of Cauchy's loss for a squared residual.
double weightOf(double squared, double scale) { return 1.0 / (1.0 + squared / (scale * scale)); }
double costOf(double squared, double scale) {
  return 0.5 * scale * scale * std::log1p(squared / (scale * scale));
}

class Problem {
 public:
  Problem(const std::vector<TrackWindow>& tracks, const std::vector<ImuSample>& samples,
          const JointOptions& options)
      : samples_(samples), options_(options), state_(options.prior) {
    for (const TrackWindow& window : tracks) {
      Window one{&window,
                 window.times.front() - kMargin + durationFromSeconds(state_.camera.time_offset_s),
                 Own::Zero(), std::vector<double>(window.tracks.size(), kUsualInverse)};
      one.own.tail<3>() = gravityIn(one);
      windows_.push_back(std::move(one));
    }
  }

  JointEstimate solve();

 private:
  void descend();
  InertialPath pathOf(const Window& window, const JointState& state) const {
    const Duration length = window.tracks->times.back() - window.tracks->times.front();
    return InertialPath(samples_, state.gyro_bias, window.from, window.from + length + 2 * kMargin);
  }
  /// Initial gravity: minus the mean force, as if the body did not accelerate.
  Eigen::Vector3d gravityIn(const Window& window) const;
  Exposures exposuresOf(const JointState& state, const Window& window) const {
    return joint::exposuresOf(window, pathOf(window, state), state.camera);
  }
  std::vector<double> squares(const JointState& state, const Window& window,
                              const Exposures& exposures) const;
  std::vector<double> allSquares() const;
  double cost(const JointState& state, const Window& window, const Exposures& exposures) const;
  double cost(const JointState& state, const std::vector<Window>& windows) const;
  template <int N>
  Reduced<N> reduce(const JointState& state, const Window& window,
                    const Exposures& exposures) const;
  std::vector<Reduced<kShared>> reduceAll() const;
  JointVector priorWeights() const {
    return excess_ * unit() * options_.prior_sigma.cwiseAbs2().cwiseInverse();
  }
  JointVector solveJoint(const std::vector<Reduced<kShared>>& all) const;
  /// Minimises the cost over the window's own unknowns for a given state, in a few steps.
  void settle(const JointState& state, Window& window) const;
  std::vector<Window> settled(const JointState& state, std::vector<Window> windows) const;
  template <int N>
  Window advanced(const Window& window, const Reduced<N>& reduced,
                  const Eigen::Matrix<double, N - kOwn, 1>& step, double length) const;
  JointVector sigmaOf(const std::vector<Reduced<kShared>>& all);
  JointVector changeOf(const std::vector<Reduced<kShared>>& all) const;
  /// The time offset that explains a window best, with the other parameters of all windows.
  tools::PartOffset offsetOf(Window window) const;
  std::vector<tools::PartOffset> offsets() const;

  /// Variance of a residual in px²; the priors are weighted relative to it.
  double unit() const { return 0.25 * scale_ * scale_; }

  const std::vector<ImuSample>& samples_;
  const JointOptions& options_;
  JointState state_;
  std::vector<Window> windows_;
  double residual_px_ = 0.0;
  double scale_ = 3.0;  ///< scale of the robust loss, px
  /// Ratio of the variance of a window's gradient to that of independent residuals.
  double excess_ = 1.0;
};

Eigen::Vector3d Problem::gravityIn(const Window& window) const {
  const double length = toSeconds(window.tracks->times.back() - window.from);
  return -kGravity * pathOf(window, state_).at(length).velocity.normalized();
}

std::vector<double> Problem::squares(const JointState& state, const Window& window,
                                     const Exposures& exposures) const {
  std::vector<double> all;
  const CameraModel lens(state.camera);
  const auto u = unknownsOf<double>(state, window.own);
  for (std::size_t k = 0; k < window.inverse.size(); ++k) {
    forResiduals<double>(window, k, exposures, lens, u,
                         [&](const Eigen::Vector2d& r) { all.push_back(r.squaredNorm()); });
  }
  return all;
}

double Problem::cost(const JointState& state, const Window& window,
                     const Exposures& exposures) const {
  double sum = 0.0, priors = 0.0;
  for (const double squared : squares(state, window, exposures)) sum += costOf(squared, scale_);
  for (const double inverse : window.inverse) {
    const double off = (inverse - kUsualInverse) / kInverseSigma;
    priors += off * off;
  }
  const double off = (window.own.tail<3>().norm() - kGravity) / kGravitySigma;
  return sum + 0.5 * unit() * (priors + off * off);
}

double Problem::cost(const JointState& state, const std::vector<Window>& windows) const {
  double sum = 0.0;
  for (const Window& window : windows) sum += cost(state, window, exposuresOf(state, window));
  const JointVector off = between(options_.prior, state).cwiseQuotient(options_.prior_sigma);
  return sum + 0.5 * excess_ * unit() * off.squaredNorm();
}

template <int N>
Reduced<N> Problem::reduce(const JointState& state, const Window& window,
                           const Exposures& exposures) const {
  Reduced<N> out;
  const CameraModel lens(state.camera);
  const auto u = unknownsOf<Jet<N>>(state, window.own);
  using Row = Eigen::Matrix<double, N + 1, 1>;
  using Full = Eigen::Matrix<double, N + 1, N + 1>;
  for (std::size_t k = 0; k < window.inverse.size(); ++k) {
    Full H = Full::Zero();
    Row g = Row::Zero();
    H(N, N) = unit() / (kInverseSigma * kInverseSigma);
    g[N] = H(N, N) * (window.inverse[k] - kUsualInverse);
    forResiduals<Jet<N>>(window, k, exposures, lens, u, [&](const auto& r) {
      const double weight = weightOf(r[0].a * r[0].a + r[1].a * r[1].a, scale_);
      for (const Jet<N>& one : {r[0], r[1]}) {
        H.noalias() += weight * one.v * one.v.transpose();
        g += weight * one.a * one.v;
      }
    });
    const Eigen::Matrix<double, N, 1> coupling = H.col(N).template head<N>();
    out.H += H.template topLeftCorner<N, N>() - coupling * coupling.transpose() / H(N, N);
    out.g += g.template head<N>() - coupling * (g[N] / H(N, N));
    out.rows.push_back(H.col(N));
    out.pulls.push_back(g[N]);
  }
  const Eigen::Vector3d gravity = window.own.tail<3>(), down = gravity.normalized();
  const double information = unit() / (kGravitySigma * kGravitySigma);
  out.H.template bottomRightCorner<3, 3>() += information * down * down.transpose();
  out.g.template tail<3>() += information * (gravity.norm() - kGravity) * down;
  // A weak prior at the present value keeps a window with few corners solvable.
  out.H.template bottomRightCorner<kOwn, kOwn>().diagonal().array() += 1e-3 * unit();
  return out;
}

std::vector<Reduced<kShared>> Problem::reduceAll() const {
  std::vector<Reduced<kShared>> all(windows_.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(all.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      const Window& window = windows_[static_cast<std::size_t>(i)];
      all[static_cast<std::size_t>(i)] =
          reduce<kShared>(state_, window, exposuresOf(state_, window));
    }
  });
  return all;
}

Joint jointOf(const Reduced<kShared>& window) {
  const Eigen::LDLT<Eigen::Matrix<double, kOwn, kOwn>> own(
      window.H.bottomRightCorner<kOwn, kOwn>());
  const Eigen::Matrix<double, kOwn, kParameters> cross =
      window.H.bottomLeftCorner<kOwn, kParameters>();
  return {window.H.topLeftCorner<kParameters, kParameters>() - cross.transpose() * own.solve(cross),
          window.g.head<kParameters>() - cross.transpose() * own.solve(window.g.tail<kOwn>())};
}

JointVector Problem::solveJoint(const std::vector<Reduced<kShared>>& all) const {
  const JointVector weight = priorWeights();
  JointMatrix H = weight.asDiagonal();
  JointVector g = weight.cwiseProduct(between(options_.prior, state_));
  for (const auto& window : all) {
    const Joint one = jointOf(window);
    H += one.H, g += one.g;
  }
  return -H.ldlt().solve(g);
}

template <int N>
Window Problem::advanced(const Window& window, const Reduced<N>& reduced,
                         const Eigen::Matrix<double, N - kOwn, 1>& step, double length) const {
  Eigen::Matrix<double, N, 1> all = Eigen::Matrix<double, N, 1>::Zero();
  all.template head<N - kOwn>() = step;
  const Own pull = reduced.g.template tail<kOwn>() + reduced.H.template bottomRows<kOwn>() * all;
  all.template tail<kOwn>() =
      -reduced.H.template bottomRightCorner<kOwn, kOwn>().ldlt().solve(pull);
  Window next = window;
  next.own += length * all.template tail<kOwn>();
  for (std::size_t k = 0; k < next.inverse.size(); ++k) {
    const auto& row = reduced.rows[k];
    next.inverse[k] -= length * (reduced.pulls[k] + row.template head<N>().dot(all)) / row[N];
  }
  return next;
}

void Problem::settle(const JointState& state, Window& window) const {
  constexpr int kRounds = 3;
  constexpr double kShortest = 1.0 / 32.0, kLittle = 1e-3;
  const Exposures exposures = exposuresOf(state, window);
  double before = cost(state, window, exposures);
  for (int round = 0; round < kRounds; ++round) {
    const auto reduced = reduce<kOwn>(state, window, exposures);
    double after = before;
    for (double length = 1.0; length > kShortest && !(after < before); length *= 0.5) {
      Window next = advanced<kOwn>(window, reduced, {}, length);
      after = cost(state, next, exposures);
      if (after < before) window = std::move(next);
    }
    if (!(before - after > kLittle * before)) return;
    before = after;
  }
}

std::vector<Window> Problem::settled(const JointState& state, std::vector<Window> windows) const {
  cv::parallel_for_(cv::Range(0, static_cast<int>(windows.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      settle(state, windows[static_cast<std::size_t>(i)]);
    }
  });
  return windows;
}

/// The sum of outer products of the windows' gradients (sandwich) accounts for residuals that are
/// correlated within a window. With few windows, its mean ratio to the information is a lower
/// bound.
JointVector Problem::sigmaOf(const std::vector<Reduced<kShared>>& all) {
  JointMatrix H = JointMatrix::Zero(), meat = H;
  for (const auto& window : all) {
    const Joint one = jointOf(window);
    H += one.H;
    meat += one.g * one.g.transpose();
  }
  const JointVector weight = priorWeights();
  const JointMatrix inverse =
      (H + JointMatrix(weight.asDiagonal())).ldlt().solve(JointMatrix::Identity());
  // Residuals of a fit are smaller than the errors; the degrees of freedom correct this.
  const double count = static_cast<double>(all.size()), taken = (inverse * H).trace();
  meat *= count / std::max(0.25 * count, count - taken);
  const double excess = (inverse * meat).trace() / taken / unit();

  const JointVector sandwich = (inverse * meat * inverse).diagonal();
  const JointVector bound = excess * unit() * (inverse * H * inverse).diagonal();
  // A prior has its stated standard deviation, however noisy the residuals are.
  const JointVector prior = excess_ * unit() * options_.prior_sigma.cwiseInverse();
  const JointVector of_prior =
      (inverse * JointMatrix(prior.cwiseAbs2().asDiagonal()) * inverse).diagonal();
  excess_ = std::max(1.0, excess);
  return (sandwich.cwiseMax(bound) + of_prior).cwiseSqrt();
}

/// The step that the later half of the windows asks for, minus that of the earlier half.
JointVector Problem::changeOf(const std::vector<Reduced<kShared>>& all) const {
  std::array<Joint, 2> halves;
  for (Joint& half : halves) half = {JointMatrix(priorWeights().asDiagonal()), JointVector::Zero()};
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Joint one = jointOf(all[i]);
    Joint& half = halves[2 * i < all.size() ? 0 : 1];
    half.H += one.H, half.g += one.g;
  }
  return halves[0].H.ldlt().solve(halves[0].g) - halves[1].H.ldlt().solve(halves[1].g);
}

/// Scales the deviations by the differences between neighbours, on which a clock has little effect.
/// Their mean would contain the effect of a clock on the residuals.
void scaleBySpread(std::vector<tools::PartOffset>& offsets) {
  constexpr double kLeast = 0.5, kNormal = 0.6745;  // smallest scale; median of a normal deviate
  std::vector<double> differences;
  for (std::size_t i = 1; i < offsets.size(); ++i) {
    const auto &a = offsets[i - 1], &b = offsets[i];
    differences.push_back(std::abs(a.offset_s - b.offset_s) / std::hypot(a.sigma_s, b.sigma_s));
  }
  if (differences.empty()) return;
  const double scale = std::clamp(medianOf(std::move(differences)) / kNormal, kLeast, 1.0);
  for (auto& one : offsets) one.sigma_s *= scale;
}

tools::PartOffset Problem::offsetOf(Window window) const {
  constexpr int kRounds = 4;
  JointState state = state_;
  double information = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    settle(state, window);
    const Joint one = jointOf(reduce<kShared>(state, window, exposuresOf(state, window)));
    information = one.H(kLater, kLater);
    if (!(information > 0.0)) break;  // nothing turns; the deviation is infinite
    state.camera.time_offset_s -= one.g[kLater] / information;
  }
  const auto& times = window.tracks->times;
  return {times.front(), times.back(), state.camera.time_offset_s,
          std::sqrt(excess_ * unit() / std::max(0.0, information))};
}

std::vector<tools::PartOffset> Problem::offsets() const {
  std::vector<tools::PartOffset> all(windows_.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(all.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      all[k] = offsetOf(windows_[k]);
    }
  });
  scaleBySpread(all);
  return all;
}

std::vector<double> Problem::allSquares() const {
  std::vector<double> all;
  for (const Window& window : windows_) {
    const auto some = squares(state_, window, exposuresOf(state_, window));
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

/// Gauss-Newton on the shared unknowns; halves a step that does not reduce the cost.
void Problem::descend() {
  constexpr double kShortest = 1.0 / 64.0, kLittle = 1e-4;  // step; share of the cost
  for (int round = 0; round < options_.most_rounds; ++round) {
    // For two-dimensional normal residuals the median square is 2 ln 2 times the variance.
    residual_px_ = std::sqrt(medianOf(allSquares()) / (2.0 * std::log(2.0)));
    scale_ = std::max(kLeastScale_px, 2.0 * residual_px_);
    windows_ = settled(state_, std::move(windows_));
    const double before = cost(state_, windows_);
    const auto reduced = reduceAll();
    const JointVector step = solveJoint(reduced);
    double after = before;
    for (double length = 1.0; length > kShortest && !(after < before); length *= 0.5) {
      const JointState next = moved(state_, length * step);
      std::vector<Window> windows;
      for (std::size_t i = 0; i < windows_.size(); ++i) {
        windows.push_back(advanced<kShared>(windows_[i], reduced[i], step, length));
      }
      windows = settled(next, std::move(windows));
      after = cost(next, windows);
      if (after < before) state_ = next, windows_ = std::move(windows);
    }
    if (!(before - after > kLittle * before)) return;
  }
}

JointEstimate Problem::solve() {
  JointEstimate out;
  if (allSquares().size() < kParameters) return out;
  descend();
  sigmaOf(reduceAll());  // sets the weight of the priors
  descend();
  const auto reduced = reduceAll();
  out.sigma = sigmaOf(reduced);
  out.change = changeOf(reduced);
  out.offsets = offsets();
  out.state = state_;
  out.windows = windows_.size();
  out.residual_px = residual_px_;
  const auto all = allSquares();
  out.residuals = all.size();
  const double limit = 9.0 * residual_px_ * residual_px_;
  out.inliers =
      static_cast<double>(std::ranges::count_if(all, [&](double s) { return s < limit; })) /
      static_cast<double>(all.size());
  return out;
}

}  // namespace

JointState moved(const JointState& state, const JointVector& step) {
  JointState next = state;
  CameraCalibration& c = next.camera;
  c.T_BC.q = (c.T_BC.q * expQuaternion(step.segment<3>(kTurnOf))).normalized();
  c.T_BC.p += step.segment<3>(kPlace);
  c.time_offset_s += step[kLater];
  c.readout_s += step[kReadout];
  next.gyro_bias += step.segment<3>(kBias);
  const double scale = std::clamp(1.0 + step[kFocal], 0.5, 2.0);
  c.fx *= scale, c.fy *= scale;
  c.cx += step[kCentre], c.cy += step[kCentre + 1];
  if (c.distortion_coefficients.size() >= 2) {
    c.distortion_coefficients[0] += step[kDistortion];
    c.distortion_coefficients[1] += step[kDistortion + 1];
  }
  return next;
}

JointVector between(const JointState& from, const JointState& to) {
  const CameraCalibration &a = from.camera, &b = to.camera;
  JointVector step = JointVector::Zero();
  step.segment<3>(kTurnOf) = logSo3(Eigen::Quaterniond(a.T_BC.q.conjugate() * b.T_BC.q));
  step[kLater] = b.time_offset_s - a.time_offset_s;
  step[kReadout] = b.readout_s - a.readout_s;
  step.segment<3>(kBias) = to.gyro_bias - from.gyro_bias;
  step[kFocal] = std::log(b.fx / a.fx);
  step[kCentre] = b.cx - a.cx, step[kCentre + 1] = b.cy - a.cy;
  if (a.distortion_coefficients.size() >= 2) {
    step[kDistortion] = b.distortion_coefficients[0] - a.distortion_coefficients[0];
    step[kDistortion + 1] = b.distortion_coefficients[1] - a.distortion_coefficients[1];
  }
  step.segment<3>(kPlace) = b.T_BC.p - a.T_BC.p;
  return step;
}

JointEstimate estimateJointly(const std::vector<TrackWindow>& windows,
                              const std::vector<ImuSample>& samples, const JointOptions& options) {
  return Problem(windows, samples, options).solve();
}

}  // namespace perdure::calibrate
