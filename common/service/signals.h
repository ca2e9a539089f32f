// Delivers SIGTERM and SIGINT as a normal call in a normal thread.
#pragma once

#include <functional>
#include <thread>

namespace perdure::service {

/// Blocks both signals in this thread and in all threads that it starts later. Create it first.
class BlockedSignals {
 public:
  BlockedSignals();
};

/// Calls `on_signal` once, in a separate thread, when one of the signals is received.
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
