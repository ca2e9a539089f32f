#include "services/semantic_filter/core/update/class_existence.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "services/semantic_filter/core/visibility/detectability.h"

namespace perdure::semantic_filter {

namespace {

/// Of A over the hypotheses, by a look's tempering and in full.
struct MeanA {
  double tempered = 0.0, full = 0.0;
};

/// π ∝ π A. Within a class the hypotheses differ by geometry alone, whose shared errors are in the
/// state: A counts in full there. Between classes, and for existence, looks share what the network
/// mistakes: A counts by the look's tempering. Returns the mean of A over the prior.
MeanA updateWeights(Track& track, const std::vector<Shares>& shares, double tempering) {
  std::map<std::string, std::pair<double, double>> classes;  // weight, Σ w A
  double mean_A = 0.0, tempered_A = 0.0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    auto& [weight, sum] = classes[track.hypotheses[i].class_name];
    weight += track.hypotheses[i].weight;
    sum += track.hypotheses[i].weight * shares[i].A;
  }
  for (const auto& [name, c] : classes) {
    if (c.first <= 0.0) continue;
    mean_A += c.second;
    tempered_A += c.first * std::pow(c.second / c.first, tempering);
  }
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const auto& [weight, sum] = classes[track.hypotheses[i].class_name];
    if (weight > 0.0) {
      track.hypotheses[i].weight *= shares[i].A * std::pow(sum / weight, tempering - 1.0);
    }
  }
  return {tempered_A, mean_A};
}

/// Each mode of yaw that all looks have weighed (core/smooth) is linearised at a state of its own,
/// and by the looks since then the filter would give up true ones before all looks are asked again.
/// One that explains this look about as well as the best keeps `least` of its class until then; the
/// class's own weight stays.
void keepSearchedModes(std::vector<Hypothesis>& hs, const std::vector<Shares>& shares,
                       double least) {
  constexpr double kAsWell = 0.05;  // of the best one's A
  struct Class {
    double before = 0.0, after = 0.0, best_A = 0.0;
  };
  std::map<std::string, Class> classes;
  for (std::size_t i = 0; i < hs.size(); ++i) {
    Class& c = classes[hs[i].class_name];
    c.before += hs[i].weight;
    c.best_A = std::max(c.best_A, shares[i].A);
  }
  for (std::size_t i = 0; i < hs.size(); ++i) {
    Hypothesis& h = hs[i];
    Class& c = classes[h.class_name];
    const bool kept = h.modes_searched && !h.moving && shares[i].A > kAsWell * c.best_A;
    if (kept) h.weight = std::max(h.weight, least * c.before);
    c.after += h.weight;
  }
  for (auto& h : hs) {
    const Class& c = classes[h.class_name];
    if (c.after > c.before) h.weight *= c.before / c.after;
  }
}

/// Existence has two accounts. "It is a real thing": looks from one place share the network's
/// mistakes, hits and misses lookalike_nats, so that A counts by the look's tempering. "It is there
/// still": a patch of wall that passes for a chair does not go away, so that A counts in full, and
/// one hit tells that the misses before it were the network's. The lower of the two is believed.
double existenceAfter(Track& track, const MeanA& mean_A, double certain) {
  const auto logOdds = [](double p) { return std::log(p / (1.0 - p)); };
  const double most = logOdds(certain), now = logOdds(std::min<double>(track.existence, certain));
  const double real =
      std::min(now + std::max(track.existence_lead, 0.0) + std::log(mean_A.tempered), most);
  const double still =
      std::min(now - std::min(track.existence_lead, 0.0) + std::log(mean_A.full), most);
  track.existence_lead = real - still;
  return 1.0 / (1.0 + std::exp(-std::min(real, still)));
}

}  // namespace

double updateClassAndExistence(Track& track, const std::vector<Shares>& shares, double tempering,
                               bool detected, const Parameters& parameters) {
  const MeanA mean_A = updateWeights(track, shares, tempering);
  if (detected)
    keepSearchedModes(track.hypotheses.write(), shares, parameters.smoothing.least_weight);
  updateDetectability(track, mean_A.full, parameters.visibility.hard_detection_share);
  return existenceAfter(track, mean_A, existenceCeiling(track, parameters.tracks));
}

}  // namespace perdure::semantic_filter
