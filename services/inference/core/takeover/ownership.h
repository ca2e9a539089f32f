// Strength with which a process may write its results. A process that is late, or that others
// considered dead, must not take the topic back with old results. It first writes with a strength
// below all others.
#pragma once

#include <chrono>
#include <cstdint>

#include "common/base/time.h"

namespace perdure::inference {

/// The strength is `strength` for the owner and one less for the standby. After a loss of form it
/// is kOutOfForm, so that any healthy process takes precedence. Form is lost by a missed lease
/// (`losses` increased), a result older than the lease, or kFailures failures of the network in a
/// row.
///
/// Form returns after kGoodResults good results in a row, and after at least kLeases leases. A
/// process that resumes after a suspension finds many old frames that appear new to it. It is then
/// a spare: it does not take the topic from another process that writes.
class Ownership {
 public:
  static constexpr std::int64_t kOutOfForm = 0;
  static constexpr int kGoodResults = 10;
  static constexpr int kLeases = 3;
  static constexpr int kFailures = 3;
  using Time = std::chrono::steady_clock::time_point;

  Ownership(std::int64_t strength, bool standby, Duration lease)
      : full_(strength - (standby ? 1 : 0)), lease_(lease) {}
  /// Returns the ownership of a rehearsing process, whose strength is below all others.
  static Ownership unheard(Duration lease) { return {kOutOfForm - 1, false, lease}; }

  /// Reports a result and returns the strength. Call it before each write. `age` is the time since
  /// this process received the frame, `losses` the number of expired leases of its writer since the
  /// start. `alone` is true if no other writer is received.
  std::int64_t strengthFor(Time now, Duration age, std::uint64_t losses, bool alone) {
    failures_ = 0;
    if (losses > losses_ || age > lease_) {
      losses_ = losses;
      loseForm(now);
    } else if (!in_form_) {
      in_form_ = ++good_ >= kGoodResults && now - lost_at_ >= kLeases * lease_;
    }
    // A process out of form stays a spare, because after a suspension it may not yet have received
    // messages of other writers.
    if (in_form_ && alone) spare_ = false;
    return strength();
  }
  /// Reports a failure of the network. Returns true if form is lost by it.
  bool noteFailure(Time now) {
    const bool lost = ++failures_ >= kFailures && in_form_;
    if (failures_ >= kFailures) loseForm(now);
    return lost;
  }
  /// Sets the strength that the swap has chosen above all others.
  void lead(std::int64_t strength) {
    full_ = strength;
    spare_ = false;
  }
  std::int64_t strength() const {
    return in_form_ && !spare_ ? full_ : full_ < kOutOfForm ? full_ : kOutOfForm;
  }
  bool inForm() const { return in_form_; }
  /// Returns true if the process lost its form and has not been alone since it regained it. It then
  /// leaves the topic to another writer.
  bool spare() const { return spare_; }

 private:
  void loseForm(Time now) {
    lost_at_ = now;
    good_ = 0;
    in_form_ = false;
    spare_ = true;
  }

  std::int64_t full_;
  Duration lease_;
  std::uint64_t losses_ = 0;
  bool in_form_ = true, spare_ = false;
  Time lost_at_{};
  int good_ = 0;  ///< good results in a row since lost_at_
  int failures_ = 0;
};

}  // namespace perdure::inference
