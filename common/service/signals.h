// SIGTERM, SIGINT and SIGHUP (the terminal was closed) end a program in order, by a normal call in
// a normal thread. SIGXFSZ is ignored, so a write beyond the largest size of a file fails like one
// to a full disk.
#pragma once

#include <functional>
#include <thread>

namespace perdure::service {

/// Blocks the signals in this thread and in all threads that it starts later. Create it first.
/// SIGHUP stays ignored if it is, as under nohup.
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
