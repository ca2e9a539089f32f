// How the gateway's port is opened, to whom, and to how much.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace perdure::gateway::web {

struct Options {
  std::string address = "127.0.0.1";
  std::int64_t port = 8765;
  std::string token;  ///< empty: none is asked for
  std::vector<std::string> allowed_hosts;
  std::vector<std::string> allowed_origins = {"https://app.foxglove.dev"};
  std::int64_t most_clients = 16;
  std::int64_t most_connections = 64;
  std::int64_t most_message_kb = 64;  ///< of what a client says
  std::int64_t most_events = 256;     ///< that wait for a slow client
};

}  // namespace perdure::gateway::web
