// The ledger of a track: every change of existence and PMF is booked under its cause, in nats. The
// entries of existence sum to log r / (1 - r), those of a class to log π. Only become() changes
// existence, and every change of weights ends in normalise() (mixture_ops.h). Derivation:
// tools/docs/maths/ledger.md.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/base/scratch.h"
#include "common/base/shared_vector.h"
#include "common/types/ledger.h"

namespace perdure::semantic_filter {

/// Number of the kinds that the filter uses: corrections of people are not a part of its beliefs.
inline constexpr auto kOwnExistence = static_cast<std::size_t>(ExistenceEvidence::kPerson);
inline constexpr auto kOwnClass = static_cast<std::size_t>(ClassEvidence::kPerson);

/// Probability that the object exists, with its reasons. Initially it is 1/2.
class Existence {
 public:
  Existence() = default;
  Existence(double r, ExistenceEvidence why, TimePoint at) { become(r, why, at); }
  /// Takes the entries of a known ledger. The rest of log r / (1 - r) is booked under `why`.
  Existence(double r, const std::vector<LedgerEntry>& known, ExistenceEvidence why, TimePoint at);

  operator double() const { return r_; }
  void become(double r, ExistenceEvidence why, TimePoint at);
  /// Moves `nats` from entry `from` to entry `to`, whose count grows by 1. 0 nats change nothing.
  void shift(ExistenceEvidence from, ExistenceEvidence to, double nats, TimePoint at);
  /// Counts observations that did not change r.
  void note(ExistenceEvidence why, const LedgerEntry& observations);

  const LedgerEntry& of(ExistenceEvidence why) const {
    return entries_[static_cast<std::size_t>(why)];
  }
  const std::array<LedgerEntry, kOwnExistence>& entries() const { return entries_; }

 private:
  double r_ = 0.5;
  std::array<LedgerEntry, kOwnExistence> entries_{};
};

/// A number for one class of a track.
struct ClassNumber {
  std::string name;
  double value = 0.0;
};

/// Numbers for the classes of a track; valid within one step only.
using ClassNumbers = ScratchVector<ClassNumber>;

/// log π of each class, with its reasons.
class ClassAccount {
 public:
  ClassAccount() = default;
  ClassAccount(const std::vector<ClassLedger>& known, const std::vector<OustedClass>& ousted);

  /// Books the change of each log π under `why`. `pmf` sums to 1. Among the classes that it lacks,
  /// the one that was closest to the best is stored as the ousted class.
  void book(const ClassNumbers& pmf, ClassEvidence why, TimePoint at);
  /// Moves a part of entry `from` to entry `to`, for each class.
  void shift(ClassEvidence from, ClassEvidence to, const ClassNumbers& nats);

  /// Writes the classes and the ousted class to `to`, whose memory is reused.
  void publish(Ledger& to) const;

 private:
  using Nats = std::array<double, kOwnClass>;
  struct Row {
    std::string name;
    Nats nats{};
  };
  struct Ousted {
    std::string name, by;
    TimePoint at;
    Nats nats{};
  };
  Row& rowOf(const std::string& name);
  void oust(const ClassNumbers& pmf, TimePoint at);

  SharedVector<Row> rows_;
  std::optional<Ousted> ousted_;
};

/// Returns the gain of log π by Bayes' rule: log_likelihood - log Σ π exp(log_likelihood).
ClassNumbers gains(const ClassNumbers& pmf, const ClassNumbers& log_likelihood);

}  // namespace perdure::semantic_filter
