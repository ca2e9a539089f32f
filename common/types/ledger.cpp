#include "common/types/ledger.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.h"

namespace perdure {

const char* nameOf(ExistenceEvidence kind) {
  static constexpr std::array kNames{"prior",  "hit",   "repeated", "miss",      "screened",
                                     "hidden", "away",  "time",     "misshapen", "lost",
                                     "shared", "merge", "restore",  "recall",    "person"};
  static_assert(kNames.size() == kExistenceEvidences);
  return nameAt(kNames, kind);
}

const char* nameOf(ClassEvidence kind) {
  static constexpr std::array kNames{"prior",   "activation", "geometry", "miss",    "motion",
                                     "pruning", "merge",      "restore",  "context", "person"};
  static_assert(kNames.size() == kClassEvidences);
  return nameAt(kNames, kind);
}

double Ledger::logOdds() const {
  double sum = 0.0;
  for (const LedgerEntry& entry : existence) sum += entry.log_odds;
  return sum;
}

double logOdds(double probability) {
  constexpr double kNearest = 1e-15;
  const double p = std::clamp(probability, kNearest, 1.0 - kNearest);
  return std::log(p / (1.0 - p));
}

}  // namespace perdure
