// Threads that share the tasks of a frame. The result of a task must not depend on its thread, so
// that the image does not depend on the number of threads.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace perdure::tools {

class Workers {
 public:
  /// `threads` >= 1, including the caller of run().
  explicit Workers(int threads);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// Calls task(0) … task(count - 1) and returns when all are done. Rethrows the first exception.
  void run(std::size_t count, const std::function<void(std::size_t)>& task);
  /// Runs `job` in parallel to the following code; waits while two jobs are running. With one
  /// thread, runs it at once.
  void post(std::function<void()> job);
  /// Waits for the posted jobs and rethrows their first exception.
  void drain();

 private:
  void work();
  void takeTasks(std::unique_lock<std::mutex>& lock);
  void keep(std::exception_ptr error);
  void rethrow(std::unique_lock<std::mutex>& lock);

  std::mutex mutex_;
  std::condition_variable wake_, done_;
  const std::function<void(std::size_t)>* task_ = nullptr;
  std::size_t next_ = 0, count_ = 0, running_ = 0, posted_ = 0;
  std::deque<std::function<void()>> jobs_;
  std::exception_ptr error_;
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace perdure::tools
