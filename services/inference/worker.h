// Runs the network in a thread behind a queue of one frame, and chooses the strength with which
// results are written.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
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

struct WorkerBus {
  bus::Writer<Detections>& detections;
  /// Reader of `detections`, connected to the writers of this and of other processes.
  const bus::RawReader& rivals;
  bus::Writer<ModelInfo>& models;
  bus::Writer<SwapNotice>& notices;
};

class Worker {
 public:
  /// `end` ends the process and may be called from any thread. `budget_ms` is the time budget of a
  /// frame; 0: none.
  Worker(Node& node, const OwnershipConfig& ownership, double budget_ms, WorkerBus bus,
         service::HealthMeter& health, std::function<void()> end);
  /// Waits for the frame that the network is processing.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  static std::int32_t firstStrength(const OwnershipConfig& ownership);

  /// Adds a frame. A frame that is still waiting is dropped and counted.
  void offer(const Frame& frame);
  /// Calibration and odometry determine the turn of the following frames.
  void onCalibration(const perdure::Calibration& calibration);
  void onOdometry(const Odometry& odometry);
  void expect(const Predictions& predictions);
  /// Asserts liveliness, unless the network is stuck. Call it several times in a lease.
  void assertAlive();
  /// Returns true unless the network has been processing a frame for longer than `longest`.
  bool goesOn(Duration longest) const;
  void heard(const Detections& detections);
  void told(const SwapNotice& notice);
  void learn(const ModelInfo& model);

  void report(ReasonCounts& counts) const;
  /// Returns state and message for Health. The message is empty if there is nothing to report.
  std::pair<HealthState, std::string> state() const;
  /// Returns the reason why this process failed; empty if it did not.
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
  void publishModel();
  void noteFailure(const Reason& reason);
  void noteLapse(Clock::time_point now);
  void adoptStrength(Clock::time_point now);
  void obey();
  std::string reducedInput() const;

  Node& node_;
  const double budget_ms_;
  Budget budget_;  ///< used by the worker's thread only
  const Duration lease_;
  WorkerBus bus_;
  service::HealthMeter& health_;
  std::function<void()> end_;
  BoundedQueue<Job> queue_{1, Overflow::kDropOldest};
  std::atomic<Clock::time_point> last_alive_{Clock::now()};
  std::atomic<Clock::time_point> busy_since_{Clock::time_point::max()};
  std::atomic<std::uint64_t> lapses_{0};
  mutable std::mutex mutex_;  ///< protects all following members and the writers
  Ownership ownership_;
  Swap swap_;
  Clock::time_point hold_until_{};  ///< no result is written before, after a lower strength
  bool silent_ = false;
  std::string failure_, last_problem_;
  ReasonCounts reasons_;
  Predictions expected_;
  /// Received, but not yet passed to the node; the same applies to `odometry_`.
  std::optional<perdure::Calibration> calibration_;
  std::optional<Odometry> odometry_;
  double scale_ = 1.0;   ///< width of the input relative to the network's own
  double age_ms_ = 0.0;  ///< time from the receipt of the last frame to its result
  std::thread thread_;
};

}  // namespace perdure::inference
