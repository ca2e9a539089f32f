// The Model Context Protocol, revisions 2024-11-05, 2025-03-26 and 2025-06-18: JSON-RPC 2.0 with
// tools. The server keeps no state between messages. It answers a request before it reads the next,
// so that a cancellation always comes too late and is ignored, as the protocol allows.
#pragma once

#include <string>
#include <string_view>

#include "services/gateway/mcp/map.h"

namespace perdure::gateway::mcp {

/// The status is that of the HTTP transport.
struct Answer {
  int status = 200;  ///< 200; 202: nothing to answer; 400: the message is not valid
  std::string text;  ///< one line of JSON; empty for status 202
};

/// Whether a client may name this revision in the header MCP-Protocol-Version.
bool isKnownRevision(std::string_view revision);

/// Answers a request, a notification or a batch of them.
Answer answer(std::string_view message, Map& map);

}  // namespace perdure::gateway::mcp
