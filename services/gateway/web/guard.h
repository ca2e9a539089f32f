// Access control by Host, Origin and token. It is needed even on loopback, because any page in a
// browser can connect to ws://127.0.0.1 or to a name that resolves to this address.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace perdure::gateway::web {

/// Takes a message of an MCP client, with its number.
using Ask = std::function<void(std::uint64_t question, std::string message)>;

struct Options {
  std::string address = "127.0.0.1";
  std::int64_t port = 8765;
  std::string token;  ///< empty: no token is required
  std::vector<std::string> allowed_hosts;
  std::vector<std::string> allowed_origins = {"https://app.foxglove.dev"};
  std::int64_t most_clients = 16;
  std::int64_t most_connections = 64;
  std::int64_t most_message_kb = 64;  ///< largest size of a client's message
  std::int64_t most_events = 256;     ///< largest number of events that wait for a slow client
};

/// Returns true for 127.0.0.0/8, ::1 and localhost.
bool isLoopback(std::string_view address);

/// Returns the name in a Host header in lower case, without port: "[::1]:80" gives "::1".
std::string hostName(std::string_view header);

class Guard {
 public:
  explicit Guard(const Options& options) : options_(options) {}

  /// Fails with host_refused if no token is configured and the Host header does not name this
  /// gateway.
  Result<void> checkHost(std::string_view host) const;
  /// Fails with origin_refused if `origin` is neither the gateway's own page (same host and port)
  /// nor in http.allowed_origins. An empty origin is accepted, because it does not come from a
  /// browser.
  Result<void> checkOrigin(std::string_view origin, std::string_view host) const;
  /// Fails with token_wrong if a token is configured and the request does not have it, in the query
  /// of `target` or as "Bearer …" in `authorization`. The comparison takes constant time.
  Result<void> checkToken(std::string_view target, std::string_view authorization) const;

 private:
  const Options options_;
};

std::string_view pathOf(std::string_view target);

}  // namespace perdure::gateway::web
