// How one inference process follows another while frames go on, as each of the two sees it: a state
// machine over what it infers, what it hears, and what it is told. No clock: time comes with each
// call. Nobody else is needed; whoever started the newcomer may be gone.
//
//   newcomer:  rehearsing ──► on probation ──► plain          gives up: silent, and ends
//   old one:   plain ──► watches ──► retires                  takes back: louder than the newcomer
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/time.h"
#include "services/inference/core/takeover/judge.h"

namespace perdure::inference {

struct SwapOptions {
  InstanceId self = 0;
  std::string model;         ///< its name, for people
  double probation_s = 0.0;  ///< above 0: a newcomer; 0: plain
  Duration lease{};
};

class Swap {
 public:
  static constexpr std::size_t kRehearsal = 15;  ///< frames in a row that make sense
  static constexpr std::size_t kPatience = 150;  ///< own results, before a rehearsal is too slow
  static constexpr int kFailures = 3;            ///< of the network in a row
  using Time = std::chrono::steady_clock::time_point;

  struct Actions {
    bool lead = false;   ///< be heard: a strength above all others
    bool yield = false;  ///< be silent from now on
    bool end = false;    ///< end the process, `failure` says whether in vain
    std::string failure;
    std::vector<Detections> again;  ///< write these again: readers may have missed them
    std::vector<SwapNotice> notices;
  };

  explicit Swap(SwapOptions options);

  void learn(const ModelInfo& model) { judge_.learn(model); }
  /// `in_form`: in time, and not taken for dead.
  void ownResult(const Detections& own, bool in_form, Time now);
  void ownFailure(const Reason& reason, Time now);
  /// What readers of `detections` hear, our own included.
  void heard(const Detections& detections, Time now);
  void told(const SwapNotice& notice, Time now);
  /// Several times in a lease.
  void tick(Time now);
  /// What is to be done since the last call.
  Actions take() { return std::exchange(actions_, {}); }

  /// Nobody else was heard for a lease.
  bool alone(Time now) const { return now - other_at_ > options_.lease; }
  bool rehearsing() const { return role_ == Role::kRehearsing; }
  /// What happened last, for people; empty where nothing did.
  const std::string& message() const { return message_; }
  /// Roll-backs by reason, taken back or given up.
  const ReasonCounts& reasons() const { return reasons_; }

 private:
  enum class Role { kPlain, kRehearsing, kProbation, kGone };
  struct Made {
    Detections detections;
    Time at;
  };
  struct Watch {
    InstanceId newcomer = 0;
    std::string model;
    Time until;
    int silent_results = 0;  ///< of our own since it was last heard
  };

  void rehearse(bool in_form, Time now);
  void takeOver(Time now);
  void pass(Time now);
  void giveUp(const Reason& reason, bool tell);
  void watch(const SwapNotice& notice, Time now);
  void takeBack(const Reason& reason, Time now);
  void retire(const SwapNotice& notice, Time now);
  void compare(const Detections& own, const Detections& other);
  void judgeNow(Time now);
  void sayAgain(Time from, Time now);
  static const FrameStamp& stampOfMade(const Made& made);
  void countRollBack(const std::string& reason);
  void notify(SwapStep step, InstanceId about, const Reason& reason = {});

  SwapOptions options_;
  Role role_;
  Judge judge_;
  Actions actions_;
  std::string message_;
  ReasonCounts reasons_;
  std::deque<Made> own_;           ///< results of ours, the newest last
  std::deque<Detections> others_;  ///< heard from others
  std::deque<FrameStamp> frames_heard_;
  InstanceId other_ = 0;  ///< whom we heard last beside ourselves
  Time other_at_{}, self_at_{};
  bool hearing_self_ = false;
  Time since_{};  ///< of the role; of the first result while rehearsing
  std::size_t results_ = 0, good_ = 0;
  int failures_ = 0;
  InstanceId follows_ = 0;  ///< whose topic a newcomer took
  std::optional<Watch> watch_;
  std::vector<Detections> again_;
  Time again_at_{}, again_from_{};  ///< when; and results since when besides
};

}  // namespace perdure::inference
