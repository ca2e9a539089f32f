// The ledger of an track: each change of its existence and of its PMF is booked under what caused
// it, in nats. The entries of existence sum to log r / (1 - r), those of a class to log π.
//
// Existence changes by become() alone, and weights end in normalise() (track.h), which books: both
// ask for the reason, so that nothing can change without one. Each booking is the difference
// between what is believed now and the sum so far, so that rounding does not add up.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/types/ledger.h"

namespace perdure::semantic_filter {

/// Probability that the track exists, with its reasons. A fresh one knows nothing: 1/2.
class Existence {
 public:
  Existence() = default;
  Existence(double r, ExistenceEvidence why, TimePoint at) { become(r, why, at); }
  /// As a ledger has it; what the ledger does not explain is booked under `why`.
  Existence(double r, const std::vector<LedgerEntry>& known, ExistenceEvidence why, TimePoint at);

  operator double() const { return r_; }
  void become(double r, ExistenceEvidence why, TimePoint at);
  /// Books a part of `from` under `to` instead; counts it once there where it is not zero.
  void shift(ExistenceEvidence from, ExistenceEvidence to, double nats, TimePoint at);
  /// KeyframeBatch that changed nothing.
  void note(ExistenceEvidence why, const LedgerEntry& observations);

  const LedgerEntry& of(ExistenceEvidence why) const {
    return entries_[static_cast<std::size_t>(why)];
  }
  std::vector<LedgerEntry> published() const { return {entries_.begin(), entries_.end()}; }

 private:
  double r_ = 0.5;
  std::array<LedgerEntry, kExistenceEvidences> entries_{};
};

/// A number for each of an track's classes.
struct ClassNumber {
  std::string name;
  double value = 0.0;
};

/// log π of each class with its reasons.
class ClassAccount {
 public:
  ClassAccount() = default;
  ClassAccount(const std::vector<ClassLedger>& known, const std::vector<OustedClass>& ousted);

  /// `pmf` sums to 1. Classes that are no longer in it leave the account; the one that came closest
  /// to the best is kept as ousted.
  void book(const std::vector<ClassNumber>& pmf, ClassEvidence why, TimePoint at);
  /// Books a part of `from` under `to` instead, for each class.
  void shift(ClassEvidence from, ClassEvidence to, const std::vector<ClassNumber>& nats);

  std::vector<ClassLedger> published() const;
  std::vector<OustedClass> ousted() const;

 private:
  using Nats = std::array<double, kClassEvidences>;
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
  void oust(const std::vector<ClassNumber>& pmf, TimePoint at);

  std::vector<Row> rows_;
  std::optional<Ousted> ousted_;
};

/// Adds what each class gains by Bayes' rule: log_likelihood - log Σ π exp(log_likelihood).
std::vector<ClassNumber> gains(const std::vector<ClassNumber>& pmf,
                               const std::vector<ClassNumber>& log_likelihood);

}  // namespace perdure::semantic_filter
