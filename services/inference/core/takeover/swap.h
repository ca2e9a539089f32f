// A new inference process takes over from an old one while frames arrive. Each of them runs this
// state machine over its own results, received results and received notices. It has no clock: each
// call passes the time. The process that started the new one is not needed.
//
//   new one:   rehearsing ──► on probation ──► plain          gives up: silent, and ends
//   old one:   plain ──► watches ──► retires                  takes back: outbids the new one
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
  std::string model;         ///< name of the model, for people
  double probation_s = 0.0;  ///< above 0: a new process that replaces another; 0: plain
  Duration lease{};
};

class Swap {
 public:
  static constexpr std::size_t kRehearsal = 15;  ///< plausible frames in a row that suffice
  static constexpr std::size_t kPatience = 150;  ///< number of own results after which a rehearsal
                                                 ///< is too slow
  static constexpr int kFailures = 3;            ///< failures in a row that end a new process
  using Time = std::chrono::steady_clock::time_point;

  struct Actions {
    bool lead = false;   ///< write with a strength above all others from now on
    bool yield = false;  ///< stop writing
    bool end = false;    ///< end the process; `failure` is empty on success
    std::string failure;
    std::vector<Detections> again;  ///< write these again, because readers may have missed them
    std::vector<SwapNotice> notices;
  };

  explicit Swap(SwapOptions options);

  void learn(const ModelInfo& model) { judge_.learn(model); }
  /// Takes an own result. `in_form` is Ownership::inForm() after this result.
  void ownResult(const Detections& own, bool in_form, Time now);
  void ownFailure(const Reason& reason);
  /// Takes each message of `detections` that readers receive, including own ones.
  void heard(const Detections& detections, Time now);
  void told(const SwapNotice& notice, Time now);
  /// Advances the time. Call it several times in a lease.
  void tick(Time now);
  Actions take() { return std::exchange(actions_, {}); }

  /// Returns true if no other writer was received for a lease.
  bool alone(Time now) const { return now - other_at_ > options_.lease; }
  bool rehearsing() const { return role_ == Role::kRehearsing; }
  /// Returns the last event as a text; empty if there was none.
  const std::string& message() const { return message_; }
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
    int silent_results = 0;  ///< own results since the last message of the new process
  };

  void rehearse(bool in_form, Time now);
  void takeOver(Time now);
  void pass();
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
  std::deque<Made> own_;           ///< own results, the newest last
  std::deque<Detections> others_;  ///< results of other processes, the newest last
  std::deque<FrameStamp> frames_heard_;
  InstanceId other_ = 0;  ///< last other process from which a result was received
  Time other_at_{}, self_at_{};
  bool hearing_self_ = false;
  Time since_{};  ///< start of the role; while rehearsing, time of the first result
  std::size_t results_ = 0, good_ = 0;
  int failures_ = 0;
  InstanceId follows_ = 0;  ///< process that this new process replaces
  std::optional<Watch> watch_;
  std::vector<Detections> again_;
  Time again_at_{}, again_from_{};  ///< time of the next repetition; oldest result to repeat
};

}  // namespace perdure::inference
