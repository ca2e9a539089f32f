// Who is on the bus: participants, and the readers and writers that each topic has.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/bus/domain.h"

namespace perdure::bus {

struct RemoteEndpoint {
  std::string wire_name;  ///< "perdure/ego/imu"
  std::string type_name;
  std::string process;  ///< of its participant, where it has a name
  bool writer = false;
};

/// Whether `process`, which writes `topic`, does the work of the service `service` in its place: of
/// "capture" (images), "vio" (odometry) or "inference" (detections), as a bridge or a driver may.
bool standsIn(std::string_view service, std::string_view topic, std::string_view process);

struct StandIn {
  std::string process, topic;
};
/// Who stands in for `service`; topics are named without `prefix`.
std::optional<StandIn> standInFor(std::string_view service,
                                  const std::vector<RemoteEndpoint>& endpoints,
                                  const std::string& prefix);

/// Watches discovery. It takes about a second until all of a running system is known.
class Discovery {
 public:
  explicit Discovery(const Participant& participant);
  /// Names of the participants known now, our own included; "" where one has none.
  std::vector<std::string> participants();
  std::vector<RemoteEndpoint> endpoints();

 private:
  Entity participants_, writers_, readers_;
};

}  // namespace perdure::bus
