// The reasons of each change of r and π: the log-odds that each kind of evidence has added. The
// published belief is the sum of these entries, so that every change has a recorded reason.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/types/description.h"

namespace perdure {

/// Kinds of evidence that change the existence. The values are positions in Ledger::existence; new
/// kinds are appended.
enum class ExistenceEvidence : std::uint8_t {
  kPrior = 0,  ///< odds of a new object before its first box
  kHit,        ///< observations in which the object was detected
  kRepeated,   ///< repeated detections from the same viewpoint, which carry little information
  kMiss,       ///< observations without a detection, computed as if nothing occluded the object
  kUnmappedOccluder,  ///< part of kMiss that is revoked: an unmapped occluder may hide the object
  kHidden,            ///< unused observations: a mapped object occluded the object (0 nats)
  kAway,              ///< unused observations: the object was outside the image (0 nats)
  kTime,              ///< survival: objects may leave
  kMisshapen,         ///< hypotheses whose size became impossible for their class
  kLost,              ///< hypotheses that the object drove off to an unknown place
  kShared,            ///< the first box may belong to another object
  kMerge,             ///< evidence of another track that was merged into this one
  kRestore,           ///< evidence from before this ledger, restored at the restart of a service
  kRecall,            ///< evidence from before this ledger, restored when the object was recalled
  kPerson,            ///< corrections by people; not a part of the belief that the map stores
};
inline constexpr std::size_t kExistenceEvidences = 15;

/// Kinds of evidence that change the class probabilities. The values are positions in
/// ClassLedger::log_odds; new kinds are appended.
enum class ClassEvidence : std::uint8_t {
  kPrior = 0,   ///< frequency of the class
  kActivation,  ///< activations of the network in the boxes of the object
  kGeometry,    ///< whether size and place explain the boxes
  kMiss,        ///< observations without a detection, which are more likely for some classes
  kMotion,      ///< whether the object moves as the class does
  kPruning,     ///< hypotheses that were pruned; the others share their weight
  kMerge,       ///< evidence of another track that was merged into this one
  kRestore,     ///< evidence from before this ledger
  kContext,     ///< earlier versions only: objects nearby
  kPerson,      ///< corrections by people; not a part of the belief that the map stores
};
inline constexpr std::size_t kClassEvidences = 10;

const char* nameOf(ExistenceEvidence kind);  ///< "prior", "hit", …
const char* nameOf(ClassEvidence kind);      ///< "prior", "activation", …

/// The sum of all evidence of one kind.
struct LedgerEntry {
  double log_odds = 0.0;    ///< nats, sum
  std::uint32_t count = 0;  ///< observations, merges, …; 0: none so far
  TimePoint first, last;    ///< times of the first and the last item counted

  bool operator==(const LedgerEntry&) const = default;
};

/// Log-odds by kind; their sum is log π of the class. Only differences between two classes matter,
/// because the normalisation removes any part that all classes share.
struct ClassLedger {
  std::string name;
  std::vector<double> log_odds;

  bool operator==(const ClassLedger&) const = default;
};

/// A class that was pruned, and its log-odds deficit against another class at that time.
struct OustedClass {
  std::string name, by;
  TimePoint at;
  std::vector<double> log_odds;  ///< log-odds by kind: `by` against `name`

  bool operator==(const OustedClass&) const = default;
};

/// The ledger of an object. It is empty if the writer does not record one.
struct Ledger {
  std::vector<LedgerEntry> existence;  ///< entries by kind; they sum to log r / (1 - r)
  std::vector<ClassLedger> classes;
  std::vector<OustedClass> ousted;  ///< at most one: the last class pruned as the strongest

  bool empty() const { return existence.empty(); }
  double logOdds() const;  ///< sum of the existence entries

  bool operator==(const Ledger&) const = default;
};

/// log p / (1 - p). Values of p within 1e-15 of 0 or 1 are clamped to that distance.
double logOdds(double probability);

}  // namespace perdure

namespace perdure::wire {

void describe(auto& a, Is<LedgerEntry> auto& d, auto& w) {
  a.number("log_odds", d.log_odds, w.log_odds, kNats);
  a.value("count", d.count, w.count);
  a.time("first_ns", d.first, w.first_ns);
  a.time("last_ns", d.last, w.last_ns);
  a.ensure("last_ns", "out_of_range", [&] { return d.first <= d.last; });
}

void describe(auto& a, Is<ClassLedger> auto& d, auto& w) {
  a.name("name", d.name, w.name);
  a.numbers("log_odds", d.log_odds, w.log_odds, kNats, kEvidenceKinds);
}

void describe(auto& a, Is<OustedClass> auto& d, auto& w) {
  a.name("name", d.name, w.name);
  a.name("by", d.by, w.by);
  a.time("at_ns", d.at, w.at_ns);
  a.numbers("log_odds", d.log_odds, w.log_odds, kNats, kEvidenceKinds);
}

void describe(auto& a, Is<Ledger> auto& d, auto& w) {
  a.list("existence", d.existence, w.why_existence, kEvidenceKinds);
  a.list("classes", d.classes, w.why_classes, kClasses + 1);
  a.list("ousted", d.ousted, w.why_ousted, 1);
}

}  // namespace perdure::wire
