// Why an object is believed: what each kind of evidence has added to its log-odds. The sums are the
// published belief, so that nothing it says can be without a reason.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/time.h"

namespace perdure {

/// What changes existence. Positions in Ledger::existence; new ones at the end.
enum class ExistenceEvidence : std::uint8_t {
  kPrior = 0,  ///< odds of a new thing before its first box
  kHit,        ///< looks that showed it
  kRepeated,   ///< looks that showed it from where it had been looked at: worth little
  kMiss,       ///< looks at its place that did not show it, as if nothing could be in the way
  kUnmappedOccluder,  ///< what of that is excused, because something off the map may hide it
  kHidden,            ///< looks that were not used: something on the map hid it (0 nats)
  kAway,              ///< looks that were not used: it was outside the picture (0 nats)
  kTime,              ///< survival: things leave
  kMisshapen,         ///< beliefs in it that lost the size of their class
  kLost,              ///< beliefs that it drove off, to where nobody knows
  kShared,            ///< its first box may have been another object's
  kMerge,             ///< what another object knew that turned out to be the same
  kRestore,           ///< what was believed before this ledger, when a service was started again
  kRecall,            ///< the same, when it came back from the map
};
inline constexpr std::size_t kExistenceEvidences = 14;

/// What changes the probabilities of classes. Positions in ClassLedger::log_odds; new ones at the
/// end.
enum class ClassEvidence : std::uint8_t {
  kPrior = 0,   ///< how frequent the class is
  kActivation,  ///< what the network said
  kGeometry,    ///< whether size and place explain the boxes
  kMiss,        ///< looks that did not show it
  kMotion,      ///< whether it moves as the class does
  kPruning,     ///< explanations that were given up; the others share what they had
  kMerge,       ///< what another object knew that turned out to be the same
  kRestore,     ///< what was believed before this ledger
  kContext,     ///< of earlier versions: what stood near it
};
inline constexpr std::size_t kClassEvidences = 9;

const char* nameOf(ExistenceEvidence kind);  ///< "prior", "hit", …
const char* nameOf(ClassEvidence kind);      ///< "prior", "activation", …

/// All evidence of one kind.
struct LedgerEntry {
  double log_odds = 0.0;    ///< nats, sum
  std::uint32_t count = 0;  ///< looks, merges, …; 0: none so far
  TimePoint first, last;    ///< of what was counted

  bool operator==(const LedgerEntry&) const = default;
};

/// By kind; they sum to log π of the class. Between two classes the differences matter: a part that
/// all classes have in common is a matter of normalisation.
struct ClassLedger {
  std::string name;
  std::vector<double> log_odds;

  bool operator==(const ClassLedger&) const = default;
};

/// A class that was given up, and by how much it was behind another one then.
struct OustedClass {
  std::string name, by;
  TimePoint at;
  std::vector<double> log_odds;  ///< by kind: `by` against `name`

  bool operator==(const OustedClass&) const = default;
};

/// Empty where the writer does not keep one.
struct Ledger {
  std::vector<LedgerEntry> existence;  ///< by kind; they sum to log r / (1 - r)
  std::vector<ClassLedger> classes;
  std::vector<OustedClass> ousted;  ///< at most one: that which was last given up as the strongest

  bool empty() const { return existence.empty(); }
  double logOdds() const;  ///< of existence: the sum

  bool operator==(const Ledger&) const = default;
};

/// log p / (1 - p); p within 1e-15 of 0 or 1 counts as that far away.
double logOdds(double probability);

}  // namespace perdure
