// SIGTERM, SIGINT and SIGHUP (the terminal was closed) end a program in order: a thread receives
// them and calls a function. SIGXFSZ is ignored, so a write beyond the file size limit fails like a
// write to a full disk.
#pragma once

#include <functional>
#include <thread>

namespace perdure::service {

/// Blocks the signals in this thread and in all threads that it starts later. Create this object
/// before other threads. If SIGHUP is ignored, as under nohup, it stays ignored.
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
