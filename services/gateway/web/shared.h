// What all connections of the server have in common; of its one thread.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>

#include "services/gateway/web/asio.h"
#include "services/gateway/web/files.h"
#include "services/gateway/web/guard.h"
#include "services/gateway/web/hub.h"
#include "services/gateway/web/options.h"

namespace perdure::gateway::web {

/// Ended with the server.
class Connection {
 public:
  virtual ~Connection() = default;
  virtual void end() = 0;
};

struct Shared {
  Options options;
  Guard guard;
  Files files;
  Hub hub;
  std::string healthz, metrics;
  std::chrono::steady_clock::time_point texts_at{};  ///< when the service's loop gave them
  std::uint64_t bytes_sent = 0, messages_sent = 0, requests = 0;
  std::set<Connection*> connections;
};

/// Reads requests, answers them, and hands a socket over to a client where it is upgraded.
void serveHttp(tcp::socket socket, std::shared_ptr<Shared> shared);
/// Takes over from HTTP. `protocol` is the subprotocol that was agreed on.
void serveClient(beast::tcp_stream stream, Request request, std::string protocol,
                 std::shared_ptr<Shared> shared);

}  // namespace perdure::gateway::web
