#include "tools/simulate/render/workers.h"

#include <utility>

#include "common/base/check.h"

namespace perdure::tools {

Workers::Workers(int threads) {
  check(threads >= 1, "there is at least one thread");
  for (int i = 1; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

Workers::~Workers() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (auto& thread : threads_) thread.join();
}

void Workers::keep(std::exception_ptr error) {
  if (!error_) error_ = std::move(error);
}

void Workers::rethrow(std::unique_lock<std::mutex>& lock) {
  const auto error = std::exchange(error_, nullptr);
  lock.unlock();
  if (error) std::rethrow_exception(error);
}

void Workers::takeTasks(std::unique_lock<std::mutex>& lock) {
  while (task_ && next_ < count_) {
    const std::size_t index = next_++;
    const auto* task = task_;
    ++running_;
    lock.unlock();
    std::exception_ptr error;
    try {
      (*task)(index);
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    if (error) {
      keep(error);
      next_ = count_;
    }
    if (--running_ == 0 && next_ >= count_) done_.notify_all();
  }
}

void Workers::run(std::size_t count, const std::function<void(std::size_t)>& task) {
  std::unique_lock lock(mutex_);
  check(task_ == nullptr, "tasks do not run tasks");
  task_ = &task, next_ = 0, count_ = count;
  wake_.notify_all();
  takeTasks(lock);
  done_.wait(lock, [&] { return running_ == 0 && next_ >= count_; });
  task_ = nullptr;
  rethrow(lock);
}

void Workers::post(std::function<void()> job) {
  if (threads_.empty()) return job();
  std::unique_lock lock(mutex_);
  done_.wait(lock, [&] { return posted_ < 2; });
  ++posted_;
  jobs_.push_back(std::move(job));
  wake_.notify_one();
}

void Workers::drain() {
  std::unique_lock lock(mutex_);
  done_.wait(lock, [&] { return posted_ == 0; });
  rethrow(lock);
}

void Workers::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] { return stop_ || !jobs_.empty() || (task_ && next_ < count_); });
    if (!jobs_.empty()) {
      const auto job = std::move(jobs_.front());
      jobs_.pop_front();
      lock.unlock();
      std::exception_ptr error;
      try {
        job();
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      if (error) keep(error);
      --posted_;
      done_.notify_all();
    } else if (task_ && next_ < count_) {
      takeTasks(lock);
    } else if (stop_) {
      return;
    }
  }
}

}  // namespace perdure::tools
