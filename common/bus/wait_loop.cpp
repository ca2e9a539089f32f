#include "common/bus/wait_loop.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/bus/dds.h"

namespace perdure::bus {

/// The wait set belongs to no participant, so that it accepts the conditions of all participants.
/// The argument ensures that DDS is initialised.
WaitLoop::WaitLoop(const Participant&)
    : guard_(dds_create_guardcondition(DDS_CYCLONEDDS_HANDLE)),
      waitset_(dds_create_waitset(DDS_CYCLONEDDS_HANDLE)) {
  check(guard_.handle() > 0 && waitset_.handle() > 0, "DDS gives a waitset and a guard condition");
  dds_waitset_attach(waitset_.handle(), guard_.handle(), 0);
}

void WaitLoop::attach(const Endpoint& reader, std::function<bool()> drain) {
  Entity condition(dds_create_readcondition(reader.handle(), DDS_ANY_STATE));
  check(condition.handle() > 0, "DDS gives a read condition");
  dds_waitset_attach(waitset_.handle(), condition.handle(), 0);
  sources_.push_back({&reader, std::move(condition), std::move(drain)});
}

void WaitLoop::off(const Endpoint& reader) {
  std::erase_if(sources_, [&](const Source& source) { return source.reader == &reader; });
}

void WaitLoop::every(std::chrono::nanoseconds period, std::function<void()> tick,
                     std::function<bool()> wanted) {
  check(period.count() > 0, "a tick has a period");
  ticks_.push_back({period, Clock::now() + period, std::move(tick), std::move(wanted)});
}

void WaitLoop::run() {
  constexpr std::chrono::seconds kLongest{1};
  while (!stopped_) runOnce(kLongest);
}

void WaitLoop::runOnce(std::chrono::nanoseconds longest) {
  dds_waitset_wait(waitset_.handle(), nullptr, 0, untilNextTick(longest).count());
  bool woken = false;
  dds_take_guardcondition(guard_.handle(), &woken);
  if (stopped_) return;
  if (woken && on_wake_) on_wake_();
  handleMessages();
  handleTicks();
}

void WaitLoop::stop() {
  stopped_ = true;
  wake();
}

void WaitLoop::wake() { dds_set_guardcondition(guard_.handle(), true); }

std::chrono::nanoseconds WaitLoop::untilNextTick(std::chrono::nanoseconds longest) const {
  const Clock::time_point now = Clock::now();
  for (const Tick& tick : ticks_) {
    if (!tick.rests()) longest = std::min<std::chrono::nanoseconds>(longest, tick.next - now);
  }
  return std::max(longest, std::chrono::nanoseconds(0));
}

void WaitLoop::handleMessages() {
  for (const Source& source : sources_) {
    if (stopped_) return;
    // Drain one batch of each source, so that a busy topic does not block the others.
    if (dds_triggered(source.condition.handle()) > 0) source.drain();
  }
}

void WaitLoop::handleTicks() {
  for (Tick& tick : ticks_) {
    const Clock::time_point now = Clock::now();
    if (stopped_ || now < tick.next || tick.rests()) continue;
    tick.next = std::max(tick.next + tick.period, now);
    tick.handler();
  }
}

}  // namespace perdure::bus
