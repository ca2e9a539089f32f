// The participants on the bus, and the readers and writers of each topic.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/bus/domain.h"

namespace perdure::bus {

struct RemoteEndpoint {
  std::string wire_name;  ///< "perdure/ego/imu"
  std::string type_name;
  std::string process;  ///< name of its participant; empty if it has none
  bool writer = false;
};

/// Returns whether `process`, which writes `topic`, replaces the service `service`. A bridge or a
/// driver may replace "capture" (images), "vio" (odometry) or "inference" (detections).
bool standsIn(std::string_view service, std::string_view topic, std::string_view process);

struct StandIn {
  std::string process, topic;
};
/// Returns the process that replaces `service`, if any, and the topic by which it was found,
/// without `prefix`.
std::optional<StandIn> standInFor(std::string_view service,
                                  const std::vector<RemoteEndpoint>& endpoints,
                                  const std::string& prefix);

/// Lists the participants and endpoints that DDS has discovered. The discovery of a running system
/// takes about a second.
class Discovery {
 public:
  explicit Discovery(const Participant& participant);
  /// Returns the names of the participants, including this one; "" for one without a name.
  std::vector<std::string> participants();
  std::vector<RemoteEndpoint> endpoints();

 private:
  Entity participants_, writers_, readers_;
};

}  // namespace perdure::bus
