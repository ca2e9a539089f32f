// Access control: Host, Origin and token are checked, because any page in a browser may open
// ws://127.0.0.1 or a name that resolves to it.
#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"
#include "services/gateway/web/options.h"

namespace perdure::gateway::web {

/// True for 127.0.0.0/8, ::1 and localhost.
bool isLoopback(std::string_view address);

/// Name in a Host header, without its port and in lower case; "[::1]:80" → "::1".
std::string hostName(std::string_view header);

class Guard {
 public:
  explicit Guard(const Options& options) : options_(options) {}

  /// Fails with host_refused if the Host header does not name this gateway.
  Result<void> checkHost(std::string_view host) const;
  /// Fails with origin_refused. Browsers send an origin; that of the own page is the host.
  Result<void> checkOrigin(std::string_view origin, std::string_view host) const;
  /// Fails with token_wrong. The token is in the target's query, or given as "Bearer …".
  Result<void> checkToken(std::string_view target, std::string_view authorization) const;

 private:
  const Options options_;
};

std::string_view pathOf(std::string_view target);

}  // namespace perdure::gateway::web
