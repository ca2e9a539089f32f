// The main loop of a service. It waits for messages, ticks and wake-ups, and calls handlers in the
// order of their registration. Handlers run in the thread that calls run(). Readers may belong to
// several participants in several domains.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <vector>

#include "common/bus/cdr_reader.h"
#include "common/bus/endpoint.h"

namespace perdure::bus {

class WaitLoop {
 public:
  explicit WaitLoop(const Participant& participant);

  /// The reader must outlive the loop.
  template <class T>
  void on(Reader<T>& reader, typename Reader<T>::Handler handler,
          typename Reader<T>::Handler on_gone = {}) {
    attach(reader, [&reader, handler = untilStopped<T>(std::move(handler)),
                    on_gone = untilStopped<T>(std::move(on_gone))] {
      return reader.drainBatch(handler, on_gone);
    });
  }
  void on(CdrReader& reader, CdrReader::Handler handler) {
    attach(reader, [&reader, handler = std::move(handler)] { return reader.drainBatch(handler); });
  }
  template <class BytesReader>
  void onBytes(BytesReader& reader, typename BytesReader::Handler handler) {
    attach(reader, [this, &reader, handler = std::move(handler)] {
      return reader.drainBatch([&](const auto& message) {
        if (!stopped_) handler(message);
      });
    });
  }
  /// Removes a reader, which may then be destroyed. Must not be called from a handler of messages
  /// or ticks, because the loop iterates over the readers while it calls these handlers.
  void off(const Endpoint& reader);
  /// Calls `tick` once per `period`; missed ticks are dropped. No ticks occur while `wanted`,
  /// called in the loop's thread, returns false.
  void every(std::chrono::nanoseconds period, std::function<void()> tick,
             std::function<bool()> wanted = {});
  /// Sets a handler that runs in the loop's thread after wake(). Several wake-ups may cause one
  /// call.
  void onWake(std::function<void()> handler) { on_wake_ = std::move(handler); }

  void run();
  /// Waits once, at most for `longest`, and handles what is available.
  void runOnce(std::chrono::nanoseconds longest);
  /// Ends run() after the current handler; the remaining messages of its batch are dropped. May be
  /// called from any thread, but not from a signal handler.
  void stop();
  bool stopped() const { return stopped_; }
  /// Wakes the loop. May be called from any thread, but not from a signal handler.
  void wake();

 private:
  using Clock = std::chrono::steady_clock;
  struct Source {
    const Endpoint* reader;
    Entity condition;
    std::function<bool()> drain;
  };
  struct Tick {
    std::chrono::nanoseconds period;
    Clock::time_point next;
    std::function<void()> handler;
    std::function<bool()> wanted;
    bool rests() const { return wanted && !wanted(); }
  };

  template <class T>
  typename Reader<T>::Handler untilStopped(typename Reader<T>::Handler handler) {
    if (!handler) return {};
    return [this, handler = std::move(handler)](const T& message) {
      if (!stopped_) handler(message);
    };
  }
  void attach(const Endpoint& reader, std::function<bool()> drain);
  std::chrono::nanoseconds untilNextTick(std::chrono::nanoseconds longest) const;
  void handleMessages();
  void handleTicks();

  Entity guard_;
  std::vector<Source> sources_;
  Entity waitset_;
  std::vector<Tick> ticks_;
  std::function<void()> on_wake_;
  std::atomic<bool> stopped_ = false;
};

}  // namespace perdure::bus
