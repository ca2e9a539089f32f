// Which strength a result may be written with: a process that was taken for dead, or that comes
// late, must not take the topic back with old results: it writes with the strength of a standby
// first.
#pragma once

#include <chrono>
#include <cstdint>

#include "common/base/time.h"

namespace perdure::inference {

/// Owner: `strength`; standby: one less; out of form: kOutOfForm, so that any healthy one is heard.
/// Form is lost by a missed lease (`losses` went up), a result older than the lease, or kFailures
/// of the network in a row. It comes back after kGoodResults in a row that are none of these, and
/// not before kLeases have passed: a process that wakes finds a heap of old frames that all look
/// new to it. Then it is a spare: it does not take the topic from another one that is heard.
class Ownership {
 public:
  static constexpr std::int64_t kOutOfForm = 0;
  static constexpr int kGoodResults = 10;
  static constexpr int kLeases = 3;
  static constexpr int kFailures = 3;
  using Time = std::chrono::steady_clock::time_point;

  Ownership(std::int64_t strength, bool standby, Duration lease)
      : full_(strength - (standby ? 1 : 0)), lease_(lease) {}
  /// Of one that rehearses: below all others, whatever happens.
  static Ownership unheard(Duration lease) { return {kOutOfForm - 1, false, lease}; }

  /// To be asked before each write. `age`: since this process got the frame; `losses`: how often
  /// its writer was taken for dead since the start; `alone`: nobody else is heard.
  std::int64_t strengthFor(Time now, Duration age, std::uint64_t losses, bool alone) {
    failures_ = 0;
    if (losses > losses_ || age > lease_) {
      losses_ = losses;
      loseForm(now);
    } else if (!in_form_) {
      in_form_ = ++good_ >= kGoodResults && now - lost_at_ >= kLeases * lease_;
    }
    if (in_form_ && alone) spare_ = false;  // one that just woke has heard nobody yet
    return strength();
  }
  /// The network gave no result. True where form is lost by it.
  bool noteFailure(Time now) {
    const bool lost = ++failures_ >= kFailures && in_form_;
    if (failures_ >= kFailures) loseForm(now);
    return lost;
  }
  /// From now on above all others, by a decision of the swap.
  void lead(std::int64_t strength) {
    full_ = strength;
    spare_ = false;
  }
  std::int64_t strength() const {
    return in_form_ && !spare_ ? full_ : full_ < kOutOfForm ? full_ : kOutOfForm;
  }
  bool inForm() const { return in_form_; }
  /// In form, but another one is heard, and stays so.
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
  int good_ = 0;  ///< results in a row since then
  int failures_ = 0;
};

}  // namespace perdure::inference
