// SIGTERM and SIGINT as an ordinary call in an ordinary thread.
#pragma once

#include <functional>
#include <thread>

namespace perdure::service {

/// Blocks both signals in this thread and all that it starts from now on: make it first.
class BlockedSignals {
 public:
  BlockedSignals();
};

/// Calls `on_signal` (once) in a thread of its own when one of them comes.
class SignalThread {
 public:
  SignalThread(const BlockedSignals& blocked, std::function<void()> on_signal);
  ~SignalThread();
  SignalThread(const SignalThread&) = delete;
  SignalThread& operator=(const SignalThread&) = delete;

 private:
  std::thread thread_;
};

}  // namespace perdure::service
