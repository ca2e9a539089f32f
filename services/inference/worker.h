// The thread that runs the network, and the writer of its results: newest frame first, and with
// the strength that the process deserves (DESIGN: Liveliness).
#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <string>
#include <thread>

#include "common/base/bounded_queue.h"
#include "common/bus/endpoint.h"
#include "common/service/health.h"
#include "services/inference/core/ownership.h"
#include "services/inference/node.h"

namespace perdure::inference {

class Worker {
 public:
  /// `rivals` reads `detections`: it matches our own writer, and those of other processes.
  Worker(Node& node, const OwnershipConfig& ownership, bus::Writer<Detections>& writer,
         const bus::RawReader& rivals, service::HealthMeter& health);
  /// Ends within the time of one frame.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// A frame to look at; one that still waits is dropped and counted.
  void offer(const Frame& frame);
  /// To be called several times in a lease: says "I live", unless the network is stuck.
  void assertAlive();

  void report(ReasonCounts& counts) const;
  /// Whether results are written with full strength.
  bool inForm() const { return in_form_; }
  /// The last thing that went wrong, for people; empty where nothing did.
  std::string lastProblem() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Job {
    Frame frame;
    Clock::time_point since;
  };
  void run();
  void publish(const Detections& detections, Duration age);
  void noteLapse(Clock::time_point now);
  void count(const char* code);

  Node& node_;
  const Duration lease_;
  Ownership ownership_;
  Clock::time_point hold_until_{};  ///< results are kept back after the strength was lowered
  bus::Writer<Detections>& writer_;
  const bus::RawReader& rivals_;
  service::HealthMeter& health_;
  BoundedQueue<Job> queue_{1, Overflow::kDropOldest};
  std::atomic<Clock::time_point> last_alive_{Clock::now()};
  std::atomic<Clock::time_point> busy_since_{Clock::time_point::max()};
  std::atomic<std::uint64_t> lapses_{0};
  std::atomic<bool> in_form_{true};
  mutable std::mutex mutex_;
  ReasonCounts reasons_;
  std::string last_problem_;
  std::thread thread_;
};

}  // namespace perdure::inference
