// Observes a running system for `perdure status`: Health, discovery, and small topics.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/discovery.h"
#include "common/bus/wait_loop.h"
#include "tools/bus_tools/rate_meter.h"
#include "tools/bus_tools/status/status.h"

namespace perdure::tools {

class StatusWatch {
 public:
  explicit StatusWatch(const bus::Options& options);

  bus::WaitLoop& loop() { return loop_; }
  void onHealth(std::function<void(const Health&)> handler) { on_health_ = std::move(handler); }
  /// Returns the present observations, without those of the host.
  StatusSeen seen();

 private:
  struct Heard {
    RateMeter rate{2.0};
    double last_s = -1.0;
    std::deque<double> latency_ms;
  };
  struct Process {
    Health before, last;
    double before_s = -1.0, last_s = -1.0;
    double began_s = -1.0;  ///< -1 if its start was not observed
    int restarts = 0;
  };

  /// Whether all latched samples have arrived by `now`. Arrivals before that do not count for
  /// rates.
  bool settled(double now) const;
  template <class T>
  void listen(const bus::Topic<T>& topic);
  void note(const Health& health);
  void arrived(Heard& heard, double latency_ms);
  ServiceSeen seenOf(const Process& process, double now) const;

  bus::Options options_;
  bus::Domain domain_;
  bus::Participant participant_;
  bus::Discovery discovery_;
  bus::WaitLoop loop_;
  std::vector<std::shared_ptr<void>> readers_;
  const double start_s_;
  std::map<std::string, Heard> topics_;
  std::map<std::string, Process> processes_;
  std::optional<Calibration> calibration_;
  std::optional<MapHeader> map_header_;
  std::optional<MapFrame> map_frame_;
  std::function<void(const Health&)> on_health_;
};

}  // namespace perdure::tools
