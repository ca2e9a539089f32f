// Strength with which a result may be written: late processes must not take the topic back.
#pragma once

#include <chrono>
#include <cstdint>

#include "common/base/time.h"

namespace perdure::inference {

/// `strength` for the owner, one less for the standby, kOutOfForm after a loss of form: a missed
/// lease, a result older than the lease, or kFailures failures in a row. Form returns after
/// kGoodResults good results in a row and kLeases leases. A process that resumes finds many old
/// frames: it is then a spare, and does not take the topic from another.
class Ownership {
 public:
  static constexpr std::int64_t kOutOfForm = 0;
  static constexpr int kGoodResults = 10;
  static constexpr int kLeases = 3;
  static constexpr int kFailures = 3;
  using Time = std::chrono::steady_clock::time_point;

  Ownership(std::int64_t strength, bool standby, Duration lease)
      : full_(strength - (standby ? 1 : 0)), lease_(lease) {}
  /// Ownership of a rehearsing process: always below all others.
  static Ownership unheard(Duration lease) { return {kOutOfForm - 1, false, lease}; }

  /// Call it before each write. `age`: since this process received the frame. `losses`: expired
  /// leases of its writer. `alone`: no other writer is received.
  std::int64_t strengthFor(Time now, Duration age, std::uint64_t losses, bool alone) {
    failures_ = 0;
    if (losses > losses_ || age > lease_) {
      losses_ = losses;
      loseForm(now);
    } else if (!in_form_) {
      in_form_ = ++good_ >= kGoodResults && now - lost_at_ >= kLeases * lease_;
    }
    // An unfit process that just resumed may not yet have received messages of other writers.
    if (in_form_ && alone) spare_ = false;
    return strength();
  }
  /// Reports that the network gave no result. Returns true if this causes the loss of form.
  bool noteFailure(Time now) {
    const bool lost = ++failures_ >= kFailures && in_form_;
    if (failures_ >= kFailures) loseForm(now);
    return lost;
  }
  /// Sets a strength above all others, as the swap decides.
  void lead(std::int64_t strength) {
    full_ = strength;
    spare_ = false;
  }
  std::int64_t strength() const {
    return in_form_ && !spare_ ? full_ : full_ < kOutOfForm ? full_ : kOutOfForm;
  }
  bool inForm() const { return in_form_; }
  /// The process is fit, but another process writes and continues to write.
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
