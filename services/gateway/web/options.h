// Options of the gateway's port: address, access and limits.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace perdure::gateway::web {

struct Options {
  std::string address = "127.0.0.1";
  std::int64_t port = 8765;
  std::string token;  ///< empty: no token is required
  std::vector<std::string> allowed_hosts;
  std::vector<std::string> allowed_origins = {"https://app.foxglove.dev"};
  std::int64_t most_clients = 16;
  std::int64_t most_connections = 64;
  std::int64_t most_message_kb = 64;  ///< size of a client's message
  std::int64_t most_events = 256;     ///< events that wait for a slow client
};

}  // namespace perdure::gateway::web
