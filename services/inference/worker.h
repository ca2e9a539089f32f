// The thread that runs the network, behind a queue of one, and what it may write: the newest frame
// counts, results carry the strength that this process deserves, and a newcomer may follow it.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "common/base/bounded_queue.h"
#include "common/bus/endpoint.h"
#include "common/service/health.h"
#include "services/inference/core/budget.h"
#include "services/inference/core/takeover/ownership.h"
#include "services/inference/core/takeover/swap.h"
#include "services/inference/node.h"

namespace perdure::inference {

/// Where a worker speaks and listens.
struct WorkerBus {
  bus::Writer<Detections>& detections;
  /// Reads `detections`: it matches our own writer, and those of other processes.
  const bus::RawReader& rivals;
  bus::Writer<SwapNotice>& notices;
};

class Worker {
 public:
  /// `end` ends the process; it is called from any thread. `budget_ms` of a frame, 0: none.
  Worker(Node& node, const OwnershipConfig& ownership, double budget_ms, WorkerBus bus,
         service::HealthMeter& health, std::function<void()> end);
  /// Ends within the time of one frame.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// The strength to begin with.
  static std::int32_t firstStrength(const OwnershipConfig& ownership);

  /// A frame to look at; one that still waits is dropped and counted.
  void offer(const Frame& frame);
  /// Where objects should be seen, for the frames that follow.
  void expect(const Predictions& predictions);
  /// To be called several times in a lease: says "I live", unless the network is stuck.
  void assertAlive();
  /// No frame has kept the network for longer than `longest`.
  bool goesOn(Duration longest) const;
  void heard(const Detections& detections);
  void told(const SwapNotice& notice);
  void learn(const ModelInfo& model);

  void report(ReasonCounts& counts) const;
  /// What Health says of it: a sentence where something is to be told.
  std::pair<HealthState, std::string> state() const;
  /// Why this process was in vain; empty where it was not.
  std::string failure() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Job {
    Frame frame;
    Clock::time_point since;
  };
  void run();
  Result<Detections> look(const Frame& frame);
  void keepBudget(double ms);
  void publish(const Detections& detections, Duration age);
  void noteFailure(const Reason& reason);
  void noteLapse(Clock::time_point now);
  void adoptStrength(Clock::time_point now);
  /// Does what the swap asks for.
  void obey();
  std::string reducedInput() const;

  Node& node_;
  const double budget_ms_;
  Budget budget_;  ///< of the worker's thread
  const Duration lease_;
  WorkerBus bus_;
  service::HealthMeter& health_;
  std::function<void()> end_;
  BoundedQueue<Job> queue_{1, Overflow::kDropOldest};
  std::atomic<Clock::time_point> last_alive_{Clock::now()};
  std::atomic<Clock::time_point> busy_since_{Clock::time_point::max()};
  std::atomic<std::uint64_t> lapses_{0};
  mutable std::mutex mutex_;  ///< of all that follows, and of the writers
  Ownership ownership_;
  Swap swap_;
  Clock::time_point hold_until_{};  ///< results are kept back after the strength was lowered
  bool silent_ = false;
  std::string failure_, last_problem_;
  ReasonCounts reasons_;
  Predictions expected_;
  double scale_ = 1.0;   ///< of the input
  double age_ms_ = 0.0;  ///< of the last result when it was ready
  std::thread thread_;
};

}  // namespace perdure::inference
