// Threads that share the tasks of a frame. The result of a task must not depend on its thread, so
// that the image does not depend on the number of threads.
#pragma once

#include <atomic>
#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <vector>

#include "common/base/check.h"

namespace perdure::tools {

class Workers {
 public:
  /// `threads` >= 1; includes the thread that calls run().
  explicit Workers(int threads) : threads_(threads) {
    check(threads >= 1, "there is at least one thread");
  }

  /// Calls task(0) … task(count - 1), and returns after all calls. Rethrows an exception of a task.
  void run(std::size_t count, const auto& task) const {
    std::atomic<std::size_t> next = 0;
    const auto work = [&] {
      for (std::size_t i = next++; i < count; i = next++) task(i);
    };
    std::vector<std::future<void>> others;
    for (int i = 1; i < threads_; ++i) others.push_back(std::async(std::launch::async, work));
    work();
    for (auto& other : others) other.get();
  }
  /// Runs `job` in parallel to the following code. If two jobs are running, waits for the older one
  /// first and rethrows its exception. With one thread, runs `job` at once.
  void post(std::function<void()> job) {
    if (threads_ == 1) return job();
    if (jobs_.size() == 2) finishFirst();
    jobs_.push_back(std::async(std::launch::async, std::move(job)));
  }
  /// Waits for the posted jobs and rethrows their first exception.
  void drain() {
    while (!jobs_.empty()) finishFirst();
  }

 private:
  void finishFirst() {
    auto job = std::move(jobs_.front());
    jobs_.pop_front();
    job.get();
  }

  int threads_;
  std::deque<std::future<void>> jobs_;
};

}  // namespace perdure::tools
