#include "services/semantic_filter/core/belief/track.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/math/gaussian.h"
#include "common/math/small_cholesky.h"
#include "common/math/so3.h"

namespace perdure::semantic_filter {
namespace {

State difference(const State& a, const State& b) {
  State d = a - b;
  d[kYaw] = wrapAngle(d[kYaw]);
  return d;
}

/// A hypothesis turned by 180° describes the same cuboid: choose the turn that is nearer.
State nearestTurn(const State& x, const State& reference) {
  State y = x;
  if (std::abs(wrapAngle(x[kYaw] - reference[kYaw])) > M_PI / 2)
    y[kYaw] = wrapAngle(x[kYaw] + M_PI);
  return y;
}

/// Rounding may leave a covariance whose parts differ by many orders with a pivot just below zero.
/// No reader takes such a message: its correlations get the least eigenvalues that are definite.
Matrix7d definite(const Matrix7d& P) {
  constexpr double kLeast = 1e-9;  // of correlations; and m², rad² for a variance
  constexpr double kRounding = 1e-12;
  Matrix7d L = P;
  // A pivot's share of its variance is that of the correlations, which is what a reader looks at.
  if (choleskyInPlace(L) &&
      (L.diagonal().array().square() > kRounding * P.diagonal().array()).all()) {
    return P;
  }
  const Vector7d sigma = P.diagonal().cwiseMax(kLeast).cwiseSqrt();
  const Vector7d inverse = sigma.cwiseInverse();
  const Matrix7d correlations = inverse.asDiagonal() * P * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix7d> parts(correlations);
  const Matrix7d& V = parts.eigenvectors();
  const Vector7d values = parts.eigenvalues().cwiseMax(kLeast);
  Matrix7d result =
      sigma.asDiagonal() * (V * values.asDiagonal() * V.transpose()) * sigma.asDiagonal();
  makeSymmetric(result);
  return result;
}

/// The Gaussian of the heaviest hypothesis, its covariance widened to what the others of the class
/// say: second moments about its mean.
ClassBelief classBelief(const Object& object, const std::string& name) {
  ClassBelief belief;
  belief.name = name;
  const Hypothesis* heaviest = nullptr;
  Matrix7d moments = Matrix7d::Zero();
  Eigen::Matrix<double, 7, 6> cross = Eigen::Matrix<double, 7, 6>::Zero();
  double weight = 0.0;
  for (const auto& h : object.hypotheses) {
    if (h.class_name != name) continue;
    belief.probability += h.weight;
    if (!heaviest) heaviest = &h;
    if (h.moving != heaviest->moving) continue;
    const Vector7d d = geometryDifference(h, *heaviest);
    moments += h.weight * (h.P.topLeftCorner<7, 7>() + d * d.transpose());
    cross += h.weight * h.C.topRows<7>();
    weight += h.weight;
  }
  belief.mean = heaviest->x.head<7>();
  belief.covariance = definite(moments / weight);
  if (name == kOtherClass && !heaviest->modes_sought) {
    constexpr double kAnyYaw = M_PI * M_PI / 12.0;  // modulo 180 degrees
    belief.covariance(kYaw, kYaw) = std::max(belief.covariance(kYaw, kYaw), kAnyYaw);
  }
  belief.cross_pose = cross / weight;
  return belief;
}

}  // namespace

double classProbability(const Object& object, const std::string& class_name) {
  double sum = 0.0;
  for (const auto& h : object.hypotheses) sum += h.class_name == class_name ? h.weight : 0.0;
  return sum;
}

double fasterThan(const Hypothesis& h, double limit) {
  const Eigen::Vector2d v = h.x.segment<2>(kVelocity);
  const Eigen::Matrix2d P = h.P.block<2, 2>(kVelocity, kVelocity);
  const double speed = v.norm();
  const double variance = speed > 1e-3 ? v.dot(P * v) / (speed * speed) : P.trace();
  const double scale = std::sqrt(2.0 * std::max(variance, 0.0)) + 1e-6;
  return 0.5 * (std::erfc((limit - speed) / scale) + std::erfc((limit + speed) / scale));
}

double movingProbability(const Object& object, double min_speed) {
  double sum = 0.0;
  for (const auto& h : object.hypotheses) {
    if (h.moving) sum += h.weight * fasterThan(h, min_speed);
  }
  return std::min(sum, 1.0);
}

bool sound(const Object& object) {
  double sum = 0.0;
  for (const auto& h : object.hypotheses) {
    // A sum is finite where all that it is of is.
    if (!std::isfinite(h.x.sum() + h.P.sum() + h.C.sum())) return false;
    sum += h.weight;
  }
  return std::isfinite(sum) && sum > 0.0 && std::isfinite(object.existence);
}

std::vector<ClassNumber> classShares(const Object& object) {
  std::vector<ClassNumber> pmf;
  pmf.reserve(object.hypotheses.size());
  double sum = 0.0;
  for (const auto& h : object.hypotheses) {
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

void book(Object& object, ClassEvidence why) {
  object.classes.book(classShares(object), why, object.as_of);
}

void normalise(Object& object, ClassEvidence why) {
  double sum = 0.0;
  for (const auto& h : object.hypotheses.read()) sum += h.weight;
  check(sum > 0.0, "an object keeps a hypothesis of positive weight");
  auto& hs = object.hypotheses.write();
  for (auto& h : hs) h.weight /= sum;
  const auto heavier = [](const auto& a, const auto& b) { return a.weight > b.weight; };
  // Few, and nearly in order: std::stable_sort would ask for memory for as many again.
  for (auto next = hs.begin(); next != hs.end(); ++next) {
    const auto at = std::upper_bound(hs.begin(), next, *next, heavier);
    if (at != next) std::rotate(at, next, next + 1);
  }
  book(object, why);
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
  a.head = wa * a.head + wb * b.head;
  a.weight = weight;
}

Vector7d geometryDifference(const Hypothesis& a, const Hypothesis& b) {
  Vector7d d = (a.x - b.x).head<kGeometry>();
  d[kYaw] = wrapAngle(d[kYaw]);
  if (std::abs(d[kYaw]) > M_PI / 2) d[kYaw] = wrapAngle(d[kYaw] + M_PI);
  return d;
}

ObjectBelief toBelief(const Object& object, double min_speed) {
  ObjectBelief belief;
  belief.id = object.id;
  belief.existence = object.existence;
  belief.confirmed = object.confirmed;
  std::vector<const std::string*> names;
  names.reserve(object.hypotheses.size());
  for (const auto& h : object.hypotheses) {
    const auto same = [&](const std::string* name) { return *name == h.class_name; };
    if (std::none_of(names.begin(), names.end(), same)) names.push_back(&h.class_name);
  }
  belief.classes.reserve(names.size());
  for (const std::string* name : names) belief.classes.push_back(classBelief(object, *name));
  const auto likelier = [](const auto& a, const auto& b) { return a.probability > b.probability; };
  if (!std::is_sorted(belief.classes.begin(), belief.classes.end(), likelier)) {
    std::stable_sort(belief.classes.begin(), belief.classes.end(), likelier);
  }
  belief.visibility = object.visibility;
  belief.visible_fraction = object.visible_fraction;
  belief.blocked_by = object.blocked_by;
  belief.first_seen = object.first_seen;
  belief.last_seen = object.last_seen;
  belief.as_of = object.as_of;
  belief.hits = object.hits;
  belief.visible_misses = object.visible_misses;
  belief.moving = movingProbability(object, min_speed);
  if (object.best().moving) belief.velocity = object.best().x.tail<3>();
  belief.recalled = object.recalled;
  belief.why = {object.existence.published(), object.classes.published(), object.classes.ousted()};
  return belief;
}

Object fromBelief(const ObjectBelief& belief, const Matrix6d& pose_product,
                  ExistenceEvidence back) {
  Object object;
  object.id = belief.id;
  object.existence = {belief.existence, belief.why.existence, back, belief.as_of};
  object.classes = {belief.why.classes, belief.why.ousted};
  object.confirmed = belief.confirmed;
  object.once_confirmed = belief.confirmed || back == ExistenceEvidence::kRecall;
  for (const auto& c : belief.classes) {
    Hypothesis h;
    h.class_name = c.name;
    h.weight = c.probability;
    h.x.head<7>() = c.mean;
    h.P.setZero();
    h.P.topLeftCorner<7, 7>() = c.covariance;
    h.C.topRows<7>() = c.cross_pose;
    h.moving = belief.moving > 0.5;
    if (h.moving) {
      h.x.tail<3>() = belief.velocity;
      h.P.diagonal().tail<3>().setConstant(1.0);  // the message does not carry it: (1 m/s)²
    }
    object.hypotheses.push_back(h);
  }
  object.first_seen = belief.first_seen;
  object.last_seen = belief.last_seen;
  object.as_of = belief.as_of;
  object.pose_product = pose_product;
  object.hits = belief.hits;
  object.visible_misses = belief.visible_misses;
  object.visibility = belief.visibility;
  object.visible_fraction = belief.visible_fraction;
  object.blocked_by = belief.blocked_by;
  object.recalled = true;
  object.remembers_all = false;
  normalise(object, ClassEvidence::kRestore);
  return object;
}

}  // namespace perdure::semantic_filter
