#include "common/mapping/fusion/belief_fusion.h"

#include <algorithm>
#include <cmath>

#include "common/mapping/frames/laid_belief.h"
#include "common/mapping/fusion/covariance_intersection.h"
#include "common/math/gaussian.h"

namespace perdure::mapping {
namespace {

/// Probability assigned to a class that only one of the two beliefs contains.
constexpr double kNotConsidered = 1e-3;
constexpr double kLeastShare = 1e-12;

const ClassBelief* classOf(const ObjectBelief& belief, const std::string& name) {
  for (const ClassBelief& c : belief.classes) {
    if (c.name == name) return &c;
  }
  return nullptr;
}

double probabilityOf(const ObjectBelief& belief, const std::string& name) {
  const ClassBelief* c = classOf(belief, name);
  return c == nullptr ? kNotConsidered : std::max(c->probability, kLeastShare);
}

/// Returns the host's weight in the fusion of the most probable class that both beliefs contain; .5
/// if they have no common class.
double weightOf(const ObjectBelief& host, const ObjectBelief& guest) {
  double weight = 0.5, likeliest = 0.0;
  for (const ClassBelief& c : host.classes) {
    const ClassBelief* same = classOf(guest, c.name);
    if (same == nullptr || c.probability * same->probability <= likeliest) continue;
    if (!isCovariance(c.covariance) || !isCovariance(same->covariance)) continue;
    likeliest = c.probability * same->probability;
    weight = intersectionWeight(c.covariance, same->covariance);
  }
  return weight;
}

ClassBelief fusedClass(const ClassBelief& host, const ClassBelief& guest, double weight) {
  ClassBelief result = host;
  if (!isCovariance(host.covariance) || !isCovariance(guest.covariance)) return result;
  const CuboidGaussian both =
      intersect({host.mean, host.covariance}, {guest.mean, guest.covariance}, weight);
  if (!both.mean.allFinite() || !isCovariance(both.covariance)) return result;
  result.mean = both.mean;
  result.covariance = both.covariance;
  return result;
}

void poolClasses(ObjectBelief& result, const ObjectBelief& guest, double weight) {
  for (const ClassBelief& c : guest.classes) {
    if (classOf(result, c.name) != nullptr) continue;
    result.classes.push_back(c);
    result.classes.back().probability = kNotConsidered;
  }
  double sum = 0.0;
  for (ClassBelief& c : result.classes) {
    c.probability = std::pow(std::max(c.probability, kLeastShare), weight) *
                    std::pow(probabilityOf(guest, c.name), 1.0 - weight);
    sum += c.probability;
  }
  for (ClassBelief& c : result.classes) c.probability /= sum;
  std::stable_sort(
      result.classes.begin(), result.classes.end(),
      [](const ClassBelief& a, const ClassBelief& b) { return a.probability > b.probability; });
}

/// Records the fusion in the ledger as a merge, so that the sums of the ledger equal the belief.
void enterMerge(ObjectBelief& result) {
  Ledger& why = result.why;
  if (why.empty()) return;
  const double pooled_in = logOdds(result.existence) - why.logOdds();
  constexpr auto kKind = static_cast<std::size_t>(ExistenceEvidence::kMerge);
  if (why.existence.size() <= kKind) why.existence.resize(kKind + 1);
  LedgerEntry& entry = why.existence[kKind];
  entry.log_odds += pooled_in;
  if (entry.count++ == 0) entry.first = result.last_seen;
  entry.last = result.last_seen;
  for (const ClassBelief& c : result.classes) {
    auto of_class = std::find_if(why.classes.begin(), why.classes.end(),
                                 [&](const ClassLedger& l) { return l.name == c.name; });
    if (of_class == why.classes.end())
      of_class = why.classes.insert(of_class, ClassLedger{c.name, {}});
    constexpr auto kOfClass = static_cast<std::size_t>(ClassEvidence::kMerge);
    auto& nats = of_class->log_odds;
    if (nats.size() <= kOfClass) nats.resize(kOfClass + 1, 0.0);
    double sum = 0.0;
    for (const double each : nats) sum += each;
    nats[kOfClass] += std::log(c.probability) - sum;
  }
}

}  // namespace

ObjectBelief fused(const ObjectBelief& host, const ObjectBelief& guest) {
  const double weight = weightOf(host, guest);
  ObjectBelief result = host;
  for (ClassBelief& c : result.classes) {
    if (const ClassBelief* same = classOf(guest, c.name)) c = fusedClass(c, *same, weight);
  }
  poolClasses(result, guest, weight);
  result.existence = pooled(host.existence, guest.existence, weight);
  result.confirmed = host.confirmed || guest.confirmed;
  result.first_seen = std::min(host.first_seen, guest.first_seen);
  result.last_seen = std::max(host.last_seen, guest.last_seen);
  result.as_of = std::max(host.as_of, guest.as_of);
  result.hits = std::max(host.hits, guest.hits);
  result.seen_from = host.seen_from.cwiseMax(guest.seen_from);
  enterMerge(result);
  return result;
}

ObjectBelief inAnchor(const Witness& witness) {
  return turned(witness.anchor.T_WA.inverse(),
                relativeToBody(witness.belief, witness.record.pose_error));
}

ObjectBelief fusedAcross(const Witness& host, const Witness& guest,
                         const LevelGaussian& T_host_guest) {
  const Anchor& home = host.anchor;
  const ObjectBelief laid = withFrameError(turned(T_host_guest.mean.rigid(), inAnchor(guest)),
                                           T_host_guest.covariance, T_host_guest.mean.p);
  ObjectBelief result = turned(home.T_WA, fused(inAnchor(host), laid));
  const Matrix6d& P_pose = host.record.pose_error;
  for (ClassBelief& c : result.classes) {
    const ClassBelief* before = classOf(host.belief, c.name);
    if (before == nullptr) continue;
    const Eigen::Matrix<double, 7, 6> B = regressOn(P_pose, before->cross_pose);
    c.covariance += B * P_pose * B.transpose();
    makeSymmetric(c.covariance);
    c.cross_pose = B * P_pose;
  }
  return result;
}

}  // namespace perdure::mapping
