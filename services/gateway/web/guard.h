// Access control: Host, Origin and token are checked, because any page in a browser may open
// ws://127.0.0.1 or a name that resolves to it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

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

/// True for 127.0.0.0/8, ::1 and localhost.
bool isLoopback(std::string_view address);

/// Name in a Host header, without its port and in lower case; "[::1]:80" → "::1".
std::string hostName(std::string_view header);

class Guard {
 public:
  explicit Guard(const Options& options) : options_(options) {}

  /// Fails with host_refused if the Host header does not name this gateway.
  Result<void> checkHost(std::string_view host) const;
  /// Fails with origin_refused. An empty origin does not come from a browser; an origin with the
  /// same host and port is the gateway's own page.
  Result<void> checkOrigin(std::string_view origin, std::string_view host) const;
  /// Fails with token_wrong. The token is in the target's query, or "Bearer …". Constant time.
  Result<void> checkToken(std::string_view target, std::string_view authorization) const;

 private:
  const Options options_;
};

std::string_view pathOf(std::string_view target);

}  // namespace perdure::gateway::web
