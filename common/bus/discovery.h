// Who is on the bus: participants, and the readers and writers that each topic has.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "common/bus/domain.h"

namespace perdure::bus {

struct RemoteEndpoint {
  std::string wire_name;  ///< "perdure/ego/imu"
  std::string type_name;
  std::string process;  ///< of its participant, where it has a name
  bool writer = false;
};

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
