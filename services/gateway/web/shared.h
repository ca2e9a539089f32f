// Data that all connections of the server share. Only the server's thread uses them.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>  // needed for std::exchange in Boost 1.74, which does not include this header

#include "services/gateway/web/files.h"
#include "services/gateway/web/guard.h"
#include "services/gateway/web/hub.h"

namespace perdure::gateway::web {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using Request = http::request<http::string_body>;

/// A connection, closed when the server ends.
class Connection {
 public:
  virtual ~Connection() = default;
  virtual void end() = 0;
};

/// Sends the answer to a question of an MCP client. `status` is that of HTTP.
using Reply = std::function<void(int status, std::string text)>;

struct Shared {
  Options options;
  Guard guard;
  Files files;
  Hub hub;
  std::string healthz, metrics;
  std::chrono::steady_clock::time_point texts_at{};  ///< last update by the service's loop
  std::uint64_t bytes_sent = 0, messages_sent = 0, requests = 0;
  std::set<Connection*> connections;
  Ask ask;                                 ///< empty: /mcp does not exist
  std::map<std::uint64_t, Reply> replies;  ///< by the number of the question
  std::uint64_t questions = 0;
};

/// Reads and answers requests, and passes the socket to a client after an upgrade.
void serveHttp(tcp::socket socket, std::shared_ptr<Shared> shared);
/// Takes over a connection from HTTP after an upgrade. `protocol`: the negotiated subprotocol.
void serveClient(beast::tcp_stream stream, Request request, std::string protocol,
                 std::shared_ptr<Shared> shared);

}  // namespace perdure::gateway::web
