#include "common/types/corrections.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.h"

namespace perdure {
namespace {

/// Adds `nats` to the ledger's entry `kind`, whose list may be shorter.
void addTo(std::vector<double>& log_odds, ClassEvidence kind, double nats) {
  const auto place = static_cast<std::size_t>(kind);
  if (log_odds.size() <= place) log_odds.resize(place + 1, 0.0);
  log_odds[place] += nats;
}

void addTo(std::vector<LedgerEntry>& existence, double log_odds, TimePoint at) {
  const auto place = static_cast<std::size_t>(ExistenceEvidence::kPerson);
  if (existence.size() <= place) existence.resize(place + 1);
  LedgerEntry& entry = existence[place];
  if (entry.count++ == 0) entry.first = entry.last = at;
  entry.log_odds += log_odds;
  entry.first = std::min(entry.first, at);
  entry.last = std::max(entry.last, at);
}

void correctExistence(const Correction& correction, ObjectBelief& belief) {
  const double before = logOdds(belief.existence);
  belief.existence = 1.0 / (1.0 + std::exp(correction.nats - before));
  belief.confirmed = belief.confirmed && belief.existence >= 0.5;
  if (!belief.why.empty()) addTo(belief.why.existence, -correction.nats, correction.time);
}

ClassBelief& classOf(ObjectBelief& belief, const std::string& name) {
  const auto named = [&](const auto& each) { return each.name == name; };
  const auto known = std::ranges::find_if(belief.classes, named);
  if (known != belief.classes.end()) return *known;
  constexpr double kPruned = 0.002;  // semantic_filter prunes lighter hypotheses
  ClassBelief added = belief.best();
  added.name = name;
  added.probability = kPruned;
  if (!belief.why.empty()) {
    std::erase_if(belief.why.classes, named);
    belief.why.classes.push_back({name, {}});
    addTo(belief.why.classes.back().log_odds, ClassEvidence::kPruning, std::log(kPruned));
  }
  return belief.classes.emplace_back(std::move(added));
}

void correctClass(const Correction& correction, ObjectBelief& belief) {
  classOf(belief, correction.class_name);
  double sum = 0.0;
  std::map<std::string, double> gains;
  for (ClassBelief& each : belief.classes) {
    gains[each.name] = each.name == correction.class_name ? correction.nats : 0.0;
    each.probability *= std::exp(gains[each.name]);
    sum += each.probability;
  }
  for (ClassBelief& each : belief.classes) each.probability /= sum;
  for (ClassLedger& row : belief.why.classes) {
    const auto gain = gains.find(row.name);
    if (gain != gains.end()) {
      addTo(row.log_odds, ClassEvidence::kPerson, gain->second - std::log(sum));
    }
  }
  std::ranges::stable_sort(belief.classes, std::greater(), &ClassBelief::probability);
}

}  // namespace

const char* nameOf(CorrectionKind kind) {
  static constexpr std::array kNames{"not_there", "class", "same", "different"};
  static_assert(kNames.size() == static_cast<std::size_t>(CorrectionKind::kDifferent) + 1);
  return nameAt(kNames, kind);
}

CorrectionsOf standingByObject(const std::vector<Correction>& corrections,
                               const std::function<ObjectId(ObjectId)>& object_of) {
  CorrectionsOf result;
  for (const Correction& correction : corrections) {
    if (correction.withdrawn) continue;
    const ObjectId object = object_of(correction.object);
    result[object].push_back(correction);
    if (!correction.aboutTwo()) continue;
    const ObjectId other = object_of(correction.other);
    if (other != object) result[other].push_back(correction);
  }
  return result;
}

void correct(const CorrectionsOf& corrections, ObjectBelief& belief) {
  const auto of_object = corrections.find(belief.id);
  if (of_object == corrections.end()) return;
  for (const Correction& correction : of_object->second) {
    if (correction.kind == CorrectionKind::kNotThere) correctExistence(correction, belief);
    if (correction.kind == CorrectionKind::kClass) correctClass(correction, belief);
  }
}

}  // namespace perdure
