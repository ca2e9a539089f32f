#include "common/types/ledger.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace perdure {

const char* nameOf(ExistenceEvidence kind) {
  switch (kind) {
    case ExistenceEvidence::kPrior:
      return "prior";
    case ExistenceEvidence::kHit:
      return "hit";
    case ExistenceEvidence::kRepeated:
      return "repeated";
    case ExistenceEvidence::kMiss:
      return "miss";
    case ExistenceEvidence::kUnmappedOccluder:
      return "screened";
    case ExistenceEvidence::kHidden:
      return "hidden";
    case ExistenceEvidence::kAway:
      return "away";
    case ExistenceEvidence::kTime:
      return "time";
    case ExistenceEvidence::kMisshapen:
      return "misshapen";
    case ExistenceEvidence::kLost:
      return "lost";
    case ExistenceEvidence::kShared:
      return "shared";
    case ExistenceEvidence::kMerge:
      return "merge";
    case ExistenceEvidence::kRestore:
      return "restore";
    case ExistenceEvidence::kRecall:
      return "recall";
  }
  failCheck("evidence of existence is one of those declared", std::source_location::current());
}

const char* nameOf(ClassEvidence kind) {
  switch (kind) {
    case ClassEvidence::kPrior:
      return "prior";
    case ClassEvidence::kActivation:
      return "activation";
    case ClassEvidence::kGeometry:
      return "geometry";
    case ClassEvidence::kMiss:
      return "miss";
    case ClassEvidence::kMotion:
      return "motion";
    case ClassEvidence::kPruning:
      return "pruning";
    case ClassEvidence::kMerge:
      return "merge";
    case ClassEvidence::kRestore:
      return "restore";
    case ClassEvidence::kContext:
      return "context";
  }
  failCheck("evidence of a class is one of those declared", std::source_location::current());
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
