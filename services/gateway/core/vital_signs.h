// The state of the services, for the page ("perdure.Health"), for /healthz and for Prometheus.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/types/health.h"

namespace perdure::gateway {

struct Figure {
  std::string name, help;
  bool counts = false;  ///< true: a counter; false: a gauge
  double value = 0;
};

/// Arrival times of the newest messages, CLOCK_MONOTONIC; 0: none has arrived.
struct Silence {
  std::int64_t objects_ns = 0, odometry_ns = 0;
};

class VitalSigns {
 public:
  explicit VitalSigns(std::string vehicle) : vehicle_(std::move(vehicle)) {}

  void onHealth(const Health& health, std::int64_t now_ns);
  bool hears(const std::string& process, std::int64_t now_ns) const;
  /// Sets the services that other programs replace. `sentences`: by service, a sentence about that
  /// program.
  void setStandIns(std::map<std::string, std::string> sentences);

  /// Returns the message "perdure.Health".
  std::string json(std::int64_t now_ns, const Silence& last) const;
  /// Returns the answer {"status": "ok", "degraded" or "silent", …} of /healthz.
  std::string healthz(std::int64_t now_ns) const;
  /// Returns the figures in Prometheus' text format 0.0.4. `own` and `own_reasons` are the
  /// gateway's.
  std::string metrics(std::int64_t now_ns, const std::vector<Figure>& own,
                      const std::map<std::string, std::uint64_t>& own_reasons) const;

 private:
  struct Service {
    Health health;
    std::int64_t heard_ns = 0;
    double cpu = -1.0;  ///< share of one core between the last two messages; < 0: unknown
  };
  /// Returns Health for display, without the faults that follow from the end of a drive.
  Health shown(const Health& health, std::int64_t now_ns) const;
  const std::string vehicle_;
  std::map<std::string, Service> services_;
  std::map<std::string, std::string> stand_ins_;
};

}  // namespace perdure::gateway
