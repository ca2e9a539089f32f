#include "services/semantic_filter/core/tracks/context.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/semantic_filter/core/belief/mixture_ops.h"

namespace perdure::semantic_filter {
namespace {

constexpr auto kEntry = static_cast<std::size_t>(ClassEvidence::kContext);

/// What the context needs of an track.
struct Neighbour {
  ObjectId id = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double r = 0.0;
  std::vector<ClassNumber> pmf;
};

/// Of the tracks at rest: what drives past is no neighbour.
std::vector<Neighbour> neighboursOf(const std::vector<Track>& tracks) {
  std::vector<Neighbour> result;
  for (const Track& o : tracks) {
    if (o.best().moving) continue;
    result.push_back({o.id, o.best().x.head<3>(), o.existence, classShares(o)});
  }
  return result;
}

/// Σ_b π_b exp(M_kb).
double expected(const std::string& class_name, const Neighbour& n, const ContextMatrix& matrix) {
  double sum = 0.0;
  for (const ClassNumber& b : n.pmf) sum += b.value * std::exp(matrix.of(class_name, b.name));
  return sum;
}

std::vector<ClassNumber> contextFrom(const Track& track, const std::vector<Neighbour>& all,
                                     const ContextMatrix& matrix) {
  std::vector<ClassNumber> context = classShares(track);
  for (ClassNumber& c : context) {
    c.value = 0.0;
    for (const Neighbour& n : all) {
      if (n.id == track.id) continue;
      if ((n.p - track.best().x.head<3>()).norm() > matrix.radius_m) continue;
      c.value += std::log(1.0 - n.r + n.r * expected(c.name, n, matrix));
    }
  }
  const auto [low, high] =
      std::minmax_element(context.begin(), context.end(),
                          [](const auto& a, const auto& b) { return a.value < b.value; });
  const double range = high->value - low->value;
  if (range > kMostContext) {
    for (ClassNumber& c : context) c.value *= kMostContext / range;
  }
  return context;
}

/// By class; 0 for a class that is not among them.
double valueOf(const std::vector<ClassNumber>& numbers, const std::string& name) {
  for (const ClassNumber& n : numbers) {
    if (n.name == name) return n.value;
  }
  return 0.0;
}

bool differs(const std::vector<ClassNumber>& fresh, const std::vector<ClassNumber>& held) {
  return std::any_of(fresh.begin(), fresh.end(), [&](const ClassNumber& c) {
    return std::abs(c.value - valueOf(held, c.name)) > kFreshContext;
  });
}

void sortByProbability(ObjectBelief& belief) {
  std::stable_sort(belief.classes.begin(), belief.classes.end(),
                   [](const auto& a, const auto& b) { return a.probability > b.probability; });
}

ClassLedger* ledgerOf(ObjectBelief& belief, const std::string& name) {
  for (ClassLedger& c : belief.why.classes) {
    if (c.name == name) return &c;
  }
  return nullptr;
}

}  // namespace

std::vector<ClassNumber> contextOf(const Track& track, const std::vector<Track>& tracks,
                                   const ContextMatrix& matrix) {
  return contextFrom(track, neighboursOf(tracks), matrix);
}

void contextualise(std::vector<Track>& tracks, const ContextMatrix& matrix) {
  if (matrix.empty()) return;
  const auto all = neighboursOf(tracks);
  for (Track& o : tracks) {
    if (o.visibility.fraction <= 0.0 || o.best().moving) continue;
    auto fresh = contextFrom(o, all, matrix);
    if (differs(fresh, o.context)) o.context = std::move(fresh);
  }
}

void addContext(ObjectBelief& belief, const Track& track) {
  if (track.context.empty()) return;
  std::vector<ClassNumber> pmf, context;
  for (const ClassBelief& c : belief.classes) {
    pmf.push_back({c.name, c.probability});
    context.push_back({c.name, valueOf(track.context, c.name)});
  }
  const auto gained = gains(pmf, context);
  for (std::size_t i = 0; i < gained.size(); ++i) {
    belief.classes[i].probability *= std::exp(gained[i].value);
    if (ClassLedger* ledger = ledgerOf(belief, gained[i].name)) {
      ledger->log_odds[kEntry] += gained[i].value;
    }
  }
  sortByProbability(belief);
}

void removeContext(ObjectBelief& belief) {
  double sum = 0.0;
  for (ClassBelief& c : belief.classes) {
    ClassLedger* ledger = ledgerOf(belief, c.name);
    if (ledger && ledger->log_odds.size() > kEntry) {
      const double nats = std::exchange(ledger->log_odds[kEntry], 0.0);
      c.probability *= std::exp(-std::clamp(nats, -kMostContext, kMostContext));
    }
    sum += c.probability;
  }
  for (ClassBelief& c : belief.classes) c.probability /= sum;
  sortByProbability(belief);
}

}  // namespace perdure::semantic_filter
