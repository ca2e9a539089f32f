#include "common/service/signals.h"

#include <pthread.h>

#include <csignal>

namespace perdure::service {
namespace {

sigset_t endSignals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGINT);
  struct sigaction hangup {};
  sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) sigaddset(&set, SIGHUP);
  return set;
}

}  // namespace

BlockedSignals::BlockedSignals() {
  const sigset_t set = endSignals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  std::signal(SIGXFSZ, SIG_IGN);
}

SignalThread::SignalThread(const BlockedSignals&, std::function<void()> on_signal)
    : thread_([on_signal = std::move(on_signal)] {
        const sigset_t set = endSignals();
        int signal = 0;
        sigwait(&set, &signal);
        on_signal();
      }) {}

SignalThread::~SignalThread() {
  pthread_kill(thread_.native_handle(), SIGTERM);  // wakes the thread if no signal was received
  thread_.join();
}

}  // namespace perdure::service
