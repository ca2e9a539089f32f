// Who may talk to the gateway: its Host and Origin, against pages that were not meant (any page in
// a browser may open ws://127.0.0.1, and a name that leads there), and the token.
#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"
#include "services/gateway/web/options.h"

namespace perdure::gateway::web {

/// 127.0.0.0/8, ::1 or localhost.
bool isLoopback(std::string_view address);

/// Of a Host header, without its port; "[::1]:80" → "::1". Lower-case.
std::string hostName(std::string_view header);

class Guard {
 public:
  explicit Guard(const Options& options) : options_(options) {}

  /// Reason host_refused: the name in the Host header is none of ours.
  Result<void> checkHost(std::string_view host) const;
  /// Reason origin_refused. An empty one is no browser's; one of the same host and port is ours.
  Result<void> checkOrigin(std::string_view origin, std::string_view host) const;
  /// Reason token_wrong. In the target's query, or as "Bearer …"; in constant time.
  Result<void> checkToken(std::string_view target, std::string_view authorization) const;

 private:
  const Options options_;
};

/// The path of a target, without its query.
std::string_view pathOf(std::string_view target);

}  // namespace perdure::gateway::web
