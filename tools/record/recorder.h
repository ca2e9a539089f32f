// Collects the messages of topics into chunks; the part of `perdure record` that uses the bus.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/cdr_reader.h"
#include "common/bus/discovery.h"
#include "common/service/service.h"
#include "tools/record/black_box.h"
#include "tools/record/store.h"

namespace perdure::tools {

struct RecorderOptions {
  std::vector<std::string> topics;           ///< empty: the topics that the table records
  bool images = false;                       ///< also topics of all cameras, unless `topics` is set
  HealthState fault = HealthState::kFailed;  ///< the mildest state that is a fault
};

/// Log times: the system time at the start plus the time elapsed on the steady clock.
class LogClock {
 public:
  LogClock();
  std::uint64_t nowNs() const;
  static std::int64_t steadyNs();
  /// Change of the system clock against the log time since the start, in nanoseconds. Slewing
  /// causes small values.
  std::int64_t setByNs() const;

 private:
  std::int64_t real_minus_steady_;
};

class Recorder {
 public:
  /// Throws StartupError if a topic does not exist.
  Recorder(service::Context& context, const RecorderOptions& options, Store& store);

  /// Hands the collected messages to the store; `fault` also requests that it writes the black box.
  void cut(bool fault = false);
  std::uint64_t messages() const { return messages_; }

 private:
  struct Source {
    bus::CdrReader reader;
    std::uint16_t channel = 0;
    std::uint32_t sequence = 0;
    bool latched = false;
    replay::mcap::Draft& draft;
  };

  bool empty() const { return draft_.empty() && images_.empty(); }
  void listen(const std::string& topic);
  std::uint16_t addChannel(const std::string& topic, const bus::TopicInfo& info);
  void onMessage(Source& source, const bus::CdrMessage& message);
  void keepLatched(const Source& source, std::span<const std::uint8_t> bytes);
  void lookForCameras();
  void onFault(const std::optional<std::string>& what);
  void updateHealth();
  void report(ReasonCounts& counts) const;

  service::Context& context_;
  const RecorderOptions options_;
  Store& store_;
  const LogClock clock_;
  bus::Discovery discovery_;
  std::map<std::string, std::unique_ptr<Source>> sources_;
  CatalogueNow catalogue_;
  LatchedNow latched_;
  /// Images have their own chunks, so that readers of other topics need not unpack images.
  replay::mcap::Draft draft_, images_;
  std::int64_t draft_began_ns_ = 0;
  FaultWatch watch_;
  const bus::Reader<Health>* health_ = nullptr;
  std::uint64_t messages_ = 0, faults_ = 0, overrun_ = 0;
  std::int64_t slow_until_ns_ = 0;
};

}  // namespace perdure::tools
