// The common part of every service's main: options, configuration, log, signals, health and
// watchdog. README.md in this folder shows an example.
#pragma once

#include <spdlog/logger.h>

#include <functional>
#include <list>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/base/sink.h"
#include "common/bus/once.h"
#include "common/bus/wait_loop.h"
#include "common/service/health.h"
#include "common/service/process.h"

namespace perdure::service {

/// Returns a log that writes to standard error.
std::shared_ptr<spdlog::logger> makeLog(const std::string& process,
                                        const std::string& level = "info");

/// Returns the time of std::chrono::steady_clock in ns.
inline std::int64_t monotonicNs() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The endpoints, loop, health and log of a service, for its body.
class Context {
 public:
  Context(const std::string& process, const bus::Options& options,
          std::shared_ptr<spdlog::logger> log)
      : Context(process, bus::Domain(options), std::move(log)) {}
  /// Constructor for a process that has already opened its domain.
  Context(const std::string& process, const bus::Domain& domain,
          std::shared_ptr<spdlog::logger> log);
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  InstanceId instance() const { return instance_; }
  bus::Participant& participant() { return participant_; }
  const std::string& vehicle() const { return domain_.options().vehicle; }
  const bus::Options& busOptions() const { return domain_.options(); }
  bus::WaitLoop& loop() { return loop_; }
  HealthMeter& health() { return health_; }
  spdlog::logger& log() { return *log_; }

  /// Creates a reader whose messages are passed to `handler` in the loop's thread. Its counts are
  /// published in Health.
  template <class T>
  bus::Reader<T>& on(const bus::Topic<T>& topic, std::type_identity_t<Sink<T>> handler,
                     std::type_identity_t<Sink<T>> on_gone = {}) {
    auto reader = std::make_shared<bus::Reader<T>>(participant_, topic);
    loop_.on(*reader, std::move(handler), std::move(on_gone));
    countReasons([reader](ReasonCounts& counts) { reader->report(counts); });
    endpoints_.push_back(reader);
    return *reader;
  }
  /// Reads calibrations, and vio's estimates, which replace those that they refine.
  void onCalibration(const Sink<Calibration>& use);
  template <class T>
  bus::Writer<T>& writer(const bus::Topic<T>& topic, const bus::WriterOptions& options = {}) {
    auto writer = std::make_shared<bus::Writer<T>>(participant_, topic, options);
    countReasons([writer](ReasonCounts& counts) { writer->report(counts); });
    endpoints_.push_back(writer);
    return *writer;
  }
  /// Creates a writer as an output of a node. Messages that cannot be written are counted in
  /// Health.
  template <class T>
  Sink<T> sink(const bus::Topic<T>& topic) {
    return [&to = writer(topic)](const T& value) { (void)to.write(value); };
  }

  /// Adds counts to Health. `source` is called once a second in the loop's thread.
  void countReasons(std::function<void(ReasonCounts&)> source);
  void countReasons(std::function<const ReasonCounts&()> source);
  /// Sets a function that is called once a second, before Health is published, to set the state.
  void onHealth(std::function<void()> update) { on_health_ = std::move(update); }

  /// Declares an input without which the service has no output. The handler of the input must call
  /// heard(). If the input arrives and then stops, Health becomes degraded at once and names it.
  Input& needs(const std::string& what, const std::string& fix) {
    if (inputs_.empty()) every(std::chrono::milliseconds(100), [this] { noteSilence(); });
    return inputs_.emplace_back(what, fix);
  }

  /// Monitors a separate thread: the watchdog is fed only while `goes_on`, called in the loop's
  /// thread, returns true.
  void watch(std::function<bool()> goes_on) { watched_.push_back(std::move(goes_on)); }

  void every(std::chrono::nanoseconds period, std::function<void()> tick) {
    loop_.every(period, std::move(tick));
  }
  /// Reports readiness and runs the loop until SIGTERM, SIGINT or stop().
  void run();
  /// Ends run(). May be called from any thread.
  void stop() { loop_.stop(); }
  bool stopping() const { return loop_.stopped(); }

 private:
  void publishHealth();
  void noteSilence();
  std::string silence() const;
  void runLoop();
  void logNewRefusals();
  void noteSharedMemory();
  std::string identityEnds() const;
  void requireIdentity() const;
  ReasonCounts reasons() const;

  const InstanceId instance_;
  std::shared_ptr<spdlog::logger> log_;
  bus::Domain domain_;
  bus::Participant participant_;
  HealthMeter health_;
  bus::Writer<Health> health_writer_;
  std::list<std::function<void(ReasonCounts&)>> reason_sources_;
  std::list<std::shared_ptr<const bus::Endpoint>> endpoints_;
  std::set<std::string> logged_refusals_;
  std::string shared_memory_;  ///< text about shared memory, as last logged
  bus::WaitLoop loop_;
  std::list<Input> inputs_;
  std::size_t silent_inputs_ = 0;
  std::function<void()> on_health_;
  std::vector<std::function<bool()>> watched_;
  ClockSteps clock_steps_;
};

struct Shorthand {
  std::string option, key, type;
};

struct Program {
  std::string process;  ///< name in Health and in the log, for example "vio"
  std::string summary;  ///< one sentence for --help
  /// Describes the service's own fields; those of bus.* and log.* are added.
  std::function<void(config::Fields&)> describe;
  /// Creates and connects the nodes, and calls context.run(). May throw StartupError before that.
  std::function<void(Context&)> body;
  /// Checks conditions between fields after reading, also for --check-config. May throw
  /// StartupError.
  std::function<void()> verify = {};
  std::vector<Shorthand> shorthands = {};
};

/// Runs the complete main of a service, and returns the exit status.
int runService(int argc, char** argv, const Program& program);

}  // namespace perdure::service
