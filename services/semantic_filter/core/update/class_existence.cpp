#include "services/semantic_filter/core/update/class_existence.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "services/semantic_filter/core/visibility/detectability.h"

namespace perdure::semantic_filter {

namespace {

/// Mean of A over the hypotheses, with tempering between classes and without.
struct MeanA {
  double tempered = 0.0, full = 0.0;
};

/// π ∝ π A. Within a class, hypotheses differ by geometry only, whose lasting errors are in the
/// state: there A counts in full. Between classes, and for existence, observations share the
/// mistakes of the network: there A counts with the exponent τ. Returns the prior means of A.
MeanA updateWeights(Track& track, const AllShares& shares, double tempering) {
  ScratchMap<std::string_view, std::pair<double, double>> classes;  // weight, Σ w A
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

/// Protects the yaw modes that a mode search (core/smoothing/mode_search.h) has weighed by all
/// keyframes. Each is linearised at its own state, so the later observations alone would let the
/// filter give up true modes before the next search. A mode that explains this observation about as
/// well as the best one keeps at least `least` of its class. The weight of the class stays.
void keepSearchedModes(std::vector<Hypothesis>& hs, const AllShares& shares, double least) {
  constexpr double kComparable = 0.05;  // least ratio to the largest A of the class
  struct Class {
    double before = 0.0, after = 0.0, best_A = 0.0;
  };
  ScratchMap<std::string_view, Class> classes;
  for (std::size_t i = 0; i < hs.size(); ++i) {
    Class& c = classes[hs[i].class_name];
    c.before += hs[i].weight;
    c.best_A = std::max(c.best_A, shares[i].A);
  }
  for (std::size_t i = 0; i < hs.size(); ++i) {
    Hypothesis& h = hs[i];
    Class& c = classes[h.class_name];
    const bool kept = h.modes_searched && !h.moving && shares[i].A > kComparable * c.best_A;
    if (kept) h.weight = std::max(h.weight, least * c.before);
    c.after += h.weight;
  }
  for (auto& h : hs) {
    const Class& c = classes[h.class_name];
    if (c.after > c.before) h.weight *= c.before / c.after;
  }
}

/// Existence has two accounts; the smaller one is believed. "It is a real object": observations
/// from one viewpoint share the mistakes of the network, hits as well as misses, so A counts with
/// the exponent τ. "It is still there": a patch of wall that resembles a chair does not go away, so
/// A counts in full, and one hit shows that the misses before it were mistakes of the network.
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

double updateClassAndExistence(Track& track, const AllShares& shares, double tempering,
                               bool detected, const Parameters& parameters) {
  const MeanA mean_A = updateWeights(track, shares, tempering);
  if (detected)
    keepSearchedModes(track.hypotheses.write(), shares, parameters.smoothing.least_weight);
  updateDetectability(track, mean_A.full, parameters.visibility.hard_detection_share);
  return existenceAfter(track, mean_A, existenceCeiling(track, parameters.tracks));
}

}  // namespace perdure::semantic_filter
