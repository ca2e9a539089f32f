#include "services/semantic_filter/core/belief/mixture_ops.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/check.h"
#include "common/math/gaussian.h"
#include "common/math/small_cholesky.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/classes/upper_part.h"

namespace perdure::semantic_filter {

namespace {

State difference(const State& a, const State& b) {
  State d = a - b;
  d[kYaw] = wrapAngle(d[kYaw]);
  return d;
}

/// Returns x, turned by 180° (the same cuboid) if its yaw is then nearer to that of `reference`.
State nearestTurn(const State& x, const State& reference) {
  State y = x;
  if (std::abs(wrapAngle(x[kYaw] - reference[kYaw])) > M_PI / 2)
    y[kYaw] = wrapAngle(x[kYaw] + M_PI);
  return y;
}

template <int N>
double squaredDeviation(const Eigen::Matrix<double, N, 1>& d,
                        const Eigen::Matrix<double, N, N>& P) {
  Eigen::Matrix<double, N, N> L = P;
  if (!choleskyInPlace(L)) return std::numeric_limits<double>::infinity();
  Eigen::Matrix<double, N, 1> whitened = d;
  whiten(L, whitened);
  return whitened.squaredNorm();
}

}  // namespace

double classProbability(const Track& track, const std::string& class_name) {
  double sum = 0.0;
  for (const auto& h : track.hypotheses) sum += h.class_name == class_name ? h.weight : 0.0;
  return sum;
}

bool sound(const Track& track) {
  double sum = 0.0;
  for (const auto& h : track.hypotheses) {
    // The sum is not finite if one of its terms is not.
    if (!std::isfinite(h.x.sum() + h.P.sum() + h.C.sum())) return false;
    sum += h.weight;
  }
  return std::isfinite(sum) && sum > 0.0 && std::isfinite(track.existence);
}

ClassNumbers classShares(const Track& track) {
  ClassNumbers pmf;
  pmf.reserve(track.hypotheses.size());
  double sum = 0.0;
  for (const auto& h : track.hypotheses) {
    const auto same = [&](const ClassNumber& c) { return c.name == h.class_name; };
    const auto it = std::find_if(pmf.begin(), pmf.end(), same);
    if (it == pmf.end()) {
      pmf.push_back({h.class_name, h.weight});
    } else {
      it->value += h.weight;
    }
    sum += h.weight;
  }
  for (auto& c : pmf) c.value /= sum;
  return pmf;
}

void book(Track& track, ClassEvidence why) {
  track.classes.book(classShares(track), why, track.as_of);
}

void normalise(Track& track, ClassEvidence why) {
  double sum = 0.0;
  for (const auto& h : track.hypotheses.read()) sum += h.weight;
  check(sum > 0.0, "an object keeps a hypothesis of positive weight");
  auto& hs = track.hypotheses.write();
  for (auto& h : hs) h.weight /= sum;
  const auto heavier = [](const auto& a, const auto& b) { return a.weight > b.weight; };
  // The hypotheses are few and nearly in order; std::stable_sort would allocate a buffer.
  for (auto next = hs.begin(); next != hs.end(); ++next) {
    const auto at = std::upper_bound(hs.begin(), next, *next, heavier);
    if (at != next) std::rotate(at, next, next + 1);
  }
  book(track, why);
}

void mergeInto(Hypothesis& a, const Hypothesis& b) {
  const double weight = a.weight + b.weight;
  const double wa = a.weight / weight, wb = b.weight / weight;
  const State delta = difference(nearestTurn(b.x, a.x), a.x);
  a.x += wb * delta;
  a.x[kYaw] = wrapAngle(a.x[kYaw]);
  a.P = (wa * a.P + wb * b.P + wa * wb * delta * delta.transpose()).eval();
  makeSymmetric(a.P);
  a.C = wa * a.C + wb * b.C;
  a.heading_log_odds = wa * a.heading_log_odds + wb * b.heading_log_odds;
  a.weight = weight;
}

Vector7d geometryDifference(const Hypothesis& a, const Hypothesis& b) {
  Vector7d d = (a.x - b.x).head<kGeometry>();
  d[kYaw] = wrapAngle(d[kYaw]);
  if (std::abs(d[kYaw]) > M_PI / 2) d[kYaw] = wrapAngle(d[kYaw] + M_PI);
  return d;
}

double distance2(const Hypothesis& a, const Hypothesis& b) {
  const Matrix7d P = a.P.topLeftCorner<kGeometry, kGeometry>();
  double result = squaredDeviation<kGeometry>(geometryDifference(a, b), P);
  if (a.moving) {
    const Eigen::Matrix3d P_v = a.P.bottomRightCorner<3, 3>();
    result += squaredDeviation<3>((a.x - b.x).tail<3>(), P_v);
  }
  return result;
}

bool misshapen(const Hypothesis& h, const ClassPrior& prior, double size_gate) {
  const SizePrior size = sizePriorOf(prior, h.upper_part);
  const Eigen::Vector3d d = h.x.segment<3>(kSize) - size.mean;
  return !(squaredDeviation<3>(d, size.covariance) < size_gate * size_gate);
}

}  // namespace perdure::semantic_filter
