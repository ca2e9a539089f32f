#include "services/inference/core/takeover/swap.h"

#include <algorithm>
#include <set>

namespace perdure::inference {
namespace {

constexpr std::size_t kRemembered = 32;  // number of stored results of each process
constexpr std::size_t kHeard = 128;      // number of stored frame stamps
// number of leases and of own results after which a new process counts as silent
constexpr int kSilence = 3;
constexpr int kWorth = 4;  // results older than this many leases are not repeated
// time without results of others after which a new process takes over
constexpr std::chrono::seconds kNobody{3};
// added to the probation, so that the last notice of the new process can arrive
constexpr std::chrono::seconds kGrace{10};

template <class T>
void keep(std::deque<T>& list, T value, std::size_t most) {
  list.push_back(std::move(value));
  if (list.size() > most) list.pop_front();
}

template <class List, class Stamp>
auto findFrame(const List& list, const FrameStamp& stamp, Stamp stampOf) {
  return std::find_if(list.rbegin(), list.rend(),
                      [&](const auto& x) { return stampOf(x).sameFrame(stamp); });
}

std::string milliseconds(Duration d) {
  return std::to_string(std::chrono::duration_cast<std::chrono::milliseconds>(d).count()) + " ms";
}

}  // namespace

const FrameStamp& Swap::stampOfMade(const Made& made) { return made.detections.stamp; }

Swap::Swap(SwapOptions options)
    : options_(std::move(options)),
      role_(options_.probation_s > 0 ? Role::kRehearsing : Role::kPlain) {}

void Swap::ownResult(const Detections& own, bool in_form, Time now) {
  failures_ = 0;
  if (role_ == Role::kGone) return;
  if (in_form) keep(own_, Made{own, now}, kRemembered);
  const auto other = findFrame(others_, own.stamp, [](const auto& d) { return d.stamp; });
  if (other != others_.rend()) compare(own, *other);
  if (watch_ && ++watch_->silent_results >= kSilence &&
      now - other_at_ > kSilence * options_.lease) {
    return takeBack({"silent", "nothing was heard from it for " + milliseconds(now - other_at_)},
                    now);
  }
  if (role_ == Role::kProbation && !in_form) {
    return giveUp({"late", "it was stopped, or its results came later than the lease"}, true);
  }
  if (role_ == Role::kRehearsing) return rehearse(in_form, now);
  judgeNow(now);
}

void Swap::rehearse(bool in_form, Time now) {
  if (results_++ == 0) {
    since_ = now;
    message_ = "rehearses, unheard";
    notify(SwapStep::kRehearsing, 0);
  }
  if (!in_form) good_ = 0;
  if (results_ > kPatience) {
    return giveUp({"slow", "after " + std::to_string(results_) + " results not " +
                               std::to_string(kRehearsal) + " in a row were in time"},
                  true);
  }
  if (in_form && now - since_ > kNobody && now - other_at_ > kNobody) return takeOver(now);
  judgeNow(now);
}

void Swap::ownFailure(const Reason& reason) {
  good_ = 0;
  if (++failures_ < kFailures || role_ == Role::kPlain || role_ == Role::kGone) return;
  giveUp({"fails", reason.code + (reason.detail.empty() ? "" : ": " + reason.detail)}, true);
}

void Swap::heard(const Detections& detections, Time now) {
  keep(frames_heard_, detections.stamp, kHeard);
  if (detections.instance == options_.self) {
    self_at_ = now;
    if (std::exchange(hearing_self_, true) || other_ == 0) return;
    const auto own = findFrame(own_, detections.stamp, stampOfMade);
    return sayAgain(own == own_.rend() ? now : own->at, now);
  }
  hearing_self_ = false;
  other_ = detections.instance;
  other_at_ = now;
  if (watch_ && watch_->newcomer == other_) watch_->silent_results = 0;
  const auto before = findFrame(others_, detections.stamp, [](const auto& d) { return d.stamp; });
  if (before != others_.rend() && before->instance == other_) return;  // a repeated result
  keep(others_, detections, kRemembered);
  const auto own = findFrame(own_, detections.stamp, stampOfMade);
  if (own != own_.rend()) compare(own->detections, detections);
  judgeNow(now);
  // The other process has delivered this frame, so this process may take over from the next one on.
  if (role_ == Role::kRehearsing && good_ >= kRehearsal) return takeOver(now);
  const bool outbid = role_ == Role::kProbation && now - since_ > 2 * options_.lease &&
                      now - self_at_ > 2 * options_.lease;
  if (outbid) giveUp({"outbid", "a stronger one is heard"}, true);
}

void Swap::compare(const Detections& own, const Detections& other) {
  if (role_ == Role::kRehearsing) {
    judge_.compare(other, own);
    ++good_;
  } else if (watch_ && watch_->newcomer == other.instance) {
    judge_.compare(own, other);
  }
}

void Swap::judgeNow(Time now) {
  if (role_ != Role::kRehearsing && !watch_) return;
  const auto complaint = judge_.complaint();
  if (!complaint) return;
  if (watch_) return takeBack(*complaint, now);
  giveUp(*complaint, true);
}

void Swap::takeOver(Time now) {
  follows_ = now - other_at_ > kNobody ? 0 : other_;
  actions_.lead = true;
  role_ = Role::kProbation;
  since_ = self_at_ = again_from_ = now;
  again_at_ = now + options_.lease / 2;
  notify(SwapStep::kTookOver, follows_, {"", judge_.summary()});
  message_ = "is heard, on probation";
  if (follows_ == 0) pass();
}

void Swap::pass() {
  role_ = Role::kPlain;
  notify(SwapStep::kPassed, follows_, {"", judge_.summary()});
  message_.clear();
}

void Swap::giveUp(const Reason& reason, bool tell) {
  role_ = Role::kGone;
  watch_.reset();
  actions_.yield = actions_.end = true;
  actions_.failure = message_ = "rolled back, " + reason.code + ": " + reason.detail;
  countRollBack(reason.code);
  if (tell) notify(SwapStep::kRolledBack, 0, reason);
}

/// Counts a roll-back by its reason. Unknown reasons from other processes are counted as "other".
void Swap::countRollBack(const std::string& reason) {
  static const std::set<std::string> known = {
      "fails", "late", "slow", "silent", "empty", "flood", "elsewhere", "outbid", "unknown_model"};
  reasons_.add("swap_rolled_back_" + (known.contains(reason) ? reason : std::string("other")));
}

void Swap::told(const SwapNotice& notice, Time now) {
  if (notice.instance == options_.self || role_ == Role::kGone) return;
  const bool about_us = notice.about == options_.self;
  if (notice.step == SwapStep::kTookOver && about_us) return watch(notice, now);
  if (notice.step == SwapStep::kPassed && about_us) return retire(notice, now);
  if (notice.step != SwapStep::kRolledBack) return;
  if (about_us && role_ != Role::kPlain) giveUp({notice.reason, notice.detail}, false);
  if (watch_ && notice.instance == watch_->newcomer) {  // the new process gave up
    watch_.reset();
    message_ = notice.model + " was rolled back, " + notice.reason + ": " + notice.detail;
    countRollBack(notice.reason);
  }
}

void Swap::watch(const SwapNotice& notice, Time now) {
  watch_ = Watch{notice.instance, notice.model,
                 now + durationFromSeconds(std::min(notice.probation_s, 1e6)) + kGrace};
  judge_.reset();
  other_at_ = now;  // the new process has one lease to send a result
  message_ = "watches " + notice.model + ", which took over";
}

void Swap::takeBack(const Reason& reason, Time now) {
  const Watch newcomer = *std::exchange(watch_, std::nullopt);
  actions_.lead = true;
  notify(SwapStep::kRolledBack, newcomer.newcomer, reason);
  actions_.notices.back().model = newcomer.model;
  message_ = newcomer.model + " was rolled back, " + reason.code + ": " + reason.detail;
  countRollBack(reason.code);
  sayAgain(own_.empty() ? now : own_.back().at, now);
}

void Swap::retire(const SwapNotice& notice, Time now) {
  if (other_ != notice.instance || alone(now)) return reasons_.add("swap_passed_unheard");
  notify(SwapStep::kRetired, notice.instance, {"", judge_.summary()});
  message_ = "retires; " + notice.model + " has passed";
  watch_.reset();
  role_ = Role::kGone;
  actions_.end = true;
}

/// Repeats recent own results of frames for which no result was received. Results since `from` may
/// not have reached all readers, so tick() repeats them later.
void Swap::sayAgain(Time from, Time now) {
  again_.clear();
  for (const Made& made : own_) {
    const auto is_same = [&](const FrameStamp& f) { return f.sameFrame(made.detections.stamp); };
    if (now - made.at > kWorth * options_.lease) continue;
    if (std::any_of(frames_heard_.begin(), frames_heard_.end(), is_same)) continue;
    again_.push_back(made.detections);
  }
  actions_.again = again_;
  again_from_ = from;
  again_at_ = now + options_.lease / 2;
}

void Swap::tick(Time now) {
  // Repeats results, because readers switch to a new owner at different times.
  if (again_at_ != Time{} && now >= again_at_) {
    again_at_ = Time{};
    for (const Made& made : own_) {
      if (made.at >= again_from_) again_.push_back(made.detections);
    }
    actions_.again.insert(actions_.again.end(), again_.begin(), again_.end());
    again_.clear();
  }
  const bool over = now - since_ >= durationFromSeconds(options_.probation_s);
  if (role_ == Role::kProbation && over && now - self_at_ <= options_.lease) pass();
  if (watch_ && now > watch_->until) {
    watch_.reset();
    message_ = "stands by";
    reasons_.add("swap_no_last_notice");
  }
}

void Swap::notify(SwapStep step, InstanceId about, const Reason& reason) {
  SwapNotice notice;
  notice.instance = options_.self;
  notice.about = about;
  notice.step = step;
  notice.probation_s = step == SwapStep::kTookOver ? options_.probation_s : 0.0;
  notice.model = options_.model;
  notice.reason = reason.code;
  notice.detail = reason.detail;
  actions_.notices.push_back(std::move(notice));
}

}  // namespace perdure::inference
