// Processes the largest number of requests per connection in order. A WebSocket upgrade ends the
// HTTP session.
#include <optional>

#include "services/gateway/mcp/protocol.h"
#include "services/gateway/protocol/server_message.h"
#include "services/gateway/web/shared.h"

namespace perdure::gateway::web {
namespace {

constexpr std::chrono::seconds kPatience{10};  // time limit of a request, and of its answer
constexpr std::uint32_t kLongestHeader = 8192;
constexpr int kMostRequests = 1000;  // requests of one connection

constexpr char kNoPage[] =
    "The page was not built, because npm was not there when Perdure was configured: install npm, "
    "run cmake and build again. Foxglove and Lichtblick connect to this same address (ws://).\n";

using Body = http::response<http::string_body>;
using FileBody = http::response<http::span_body<const char>>;

class HttpSession : public Connection, public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(tcp::socket socket, std::shared_ptr<Shared> shared)
      : stream_(std::move(socket)), shared_(std::move(shared)) {
    shared_->connections.insert(this);
  }
  ~HttpSession() override { shared_->connections.erase(this); }

  void read() {
    parser_.emplace();
    parser_->header_limit(kLongestHeader);
    constexpr std::uint64_t kKilobyte = 1024;
    parser_->body_limit(kKilobyte * static_cast<std::uint64_t>(shared_->options.most_message_kb));
    stream_.expires_after(kPatience);
    http::async_read(
        stream_, buffer_, *parser_,
        [self = shared_from_this()](beast::error_code error, std::size_t) { self->onRead(error); });
  }
  void end() override {
    beast::error_code ignored;
    stream_.socket().close(ignored);
  }

 private:
  void onRead(beast::error_code error);
  void upgrade();
  void answer();
  void answerQuestion();
  void answerFile(std::string_view path);
  void refuse(http::status status, const Reason& reason);
  void say(http::status status, const char* type, std::string text);
  template <class Response>
  void send(std::shared_ptr<Response> response, std::shared_ptr<const void> keeper);

  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{kLongestHeader};
  std::optional<http::request_parser<http::string_body>> parser_;
  std::shared_ptr<Shared> shared_;
  int served_ = 0;
};

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

void HttpSession::onRead(beast::error_code error) {
  if (error == beast::error::timeout) {
    // The timeout of an idle connection is not counted, because browsers keep connections open.
    if (parser_->got_some()) shared_->hub.reasons().add("http_too_slow");
    return;
  }
  if (error == http::error::header_limit || error == http::error::body_limit ||
      error == http::error::buffer_overflow) {
    shared_->hub.reasons().add("http_too_large");
    return;
  }
  if (error) {
    // A connection that the client closes is not counted as an error.
    const bool hung_up = error == http::error::end_of_stream || error == asio::error::eof ||
                         error.category() == asio::error::get_system_category();
    if (!hung_up) shared_->hub.reasons().add("http_malformed");
    return;
  }
  ++shared_->requests;
  const auto host = view(parser_->get()[http::field::host]);
  if (const auto ours = shared_->guard.checkHost(host); !ours) {
    refuse(http::status::misdirected_request, ours.error());
  } else if (websocket::is_upgrade(parser_->get())) {
    upgrade();
  } else {
    answer();
  }
}

void HttpSession::upgrade() {
  const Request& request = parser_->get();
  const auto& options = shared_->options;
  const auto origin = shared_->guard.checkOrigin(view(request[http::field::origin]),
                                                 view(request[http::field::host]));
  const auto token =
      shared_->guard.checkToken(view(request.target()), view(request[http::field::authorization]));
  const auto protocol =
      protocol::chooseSubprotocol(view(request[http::field::sec_websocket_protocol]));
  if (!origin) return refuse(http::status::forbidden, origin.error());
  if (!token) return refuse(http::status::unauthorized, token.error());
  if (protocol.empty()) {
    return refuse(http::status::bad_request,
                  {"subprotocol_missing", "offer foxglove.sdk.v1 or foxglove.websocket.v1"});
  }
  if (shared_->hub.clients() >= static_cast<std::size_t>(options.most_clients)) {
    return refuse(http::status::service_unavailable,
                  {"too_many_clients", "limits.clients look already"});
  }
  serveClient(std::move(stream_), parser_->release(), std::string(protocol), shared_);
}

/// Answers a message of an MCP client (Streamable HTTP without streams and sessions).
void HttpSession::answerQuestion() {
  Request& request = parser_->get();
  if (request.method() != http::verb::post) {
    return refuse(http::status::method_not_allowed,
                  {"method_refused", "only POST: there is no stream, and there are no sessions"});
  }
  const auto origin = shared_->guard.checkOrigin(view(request[http::field::origin]),
                                                 view(request[http::field::host]));
  if (!origin) return refuse(http::status::forbidden, origin.error());
  const auto token =
      shared_->guard.checkToken(view(request.target()), view(request[http::field::authorization]));
  if (!token) return refuse(http::status::unauthorized, token.error());
  const auto revision = view(request["MCP-Protocol-Version"]);
  if (!revision.empty() && !mcp::isKnownRevision(revision)) {
    return refuse(http::status::bad_request,
                  {"mcp_revision_unknown", "MCP-Protocol-Version is none of this server's"});
  }
  const std::uint64_t number = ++shared_->questions;
  shared_->replies[number] = [self = shared_from_this()](int status, std::string text) {
    self->say(static_cast<http::status>(status), "application/json", std::move(text));
  };
  shared_->ask(number, std::move(request.body()));
}

void HttpSession::answer() {
  const Request& request = parser_->get();
  if (shared_->ask && pathOf(view(request.target())) == "/mcp") return answerQuestion();
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    return refuse(http::status::method_not_allowed, {"method_refused", "only GET and HEAD"});
  }
  const auto path = pathOf(view(request.target()));
  if (path == "/healthz") {
    constexpr std::chrono::seconds kLongest{5};
    const bool hangs = std::chrono::steady_clock::now() - shared_->texts_at > kLongest;
    return say(hangs ? http::status::service_unavailable : http::status::ok, "application/json",
               hangs ? R"({"status":"the gateway's loop hangs"})" : shared_->healthz);
  }
  if (path == "/metrics") {
    const auto token = shared_->guard.checkToken(view(request.target()),
                                                 view(request[http::field::authorization]));
    if (!token) return refuse(http::status::unauthorized, token.error());
    return say(http::status::ok, "text/plain; version=0.0.4; charset=utf-8", shared_->metrics);
  }
  answerFile(path);
}

template <class Fields>
void putCommonFields(Fields& fields) {
  fields.set(http::field::server, "perdure-gateway");
  fields.set(http::field::cache_control, "no-cache");
  fields.set("X-Content-Type-Options", "nosniff");
  fields.set("Referrer-Policy", "no-referrer");
  fields.set("Content-Security-Policy",
             "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; "
             "object-src 'none'; base-uri 'none'; frame-ancestors 'none'");
}

void HttpSession::answerFile(std::string_view path) {
  const auto file = shared_->files.find(path);
  if (!file) {
    if (path == "/" || path == "/index.html") {
      return say(http::status::ok, "text/plain; charset=utf-8", kNoPage);
    }
    return say(http::status::not_found, "text/plain; charset=utf-8", "There is no such file.\n");
  }
  const Request& request = parser_->get();
  const bool packs =
      !file->packed.empty() &&
      view(request[http::field::accept_encoding]).find("gzip") != std::string_view::npos;
  const bool known = view(request[http::field::if_none_match]) == file->tag;
  const std::string& content = packs ? file->packed : file->content;
  auto response = std::make_shared<FileBody>(known ? http::status::not_modified : http::status::ok,
                                             request.version());
  putCommonFields(*response);
  response->set(http::field::content_type, file->type);
  response->set(http::field::etag, file->tag);
  response->set(http::field::vary, "Accept-Encoding");
  if (packs && !known) response->set(http::field::content_encoding, "gzip");
  const bool bare = known || request.method() == http::verb::head;
  if (!known) response->content_length(content.size());
  if (!bare) response->body() = beast::span<const char>(content.data(), content.size());
  send(std::move(response), file);
}

void HttpSession::refuse(http::status status, const Reason& reason) {
  shared_->hub.reasons().add(reason);
  say(status, "text/plain; charset=utf-8", reason.detail + "\n");
}

void HttpSession::say(http::status status, const char* type, std::string text) {
  const Request& request = parser_->get();
  auto response = std::make_shared<Body>(status, request.version());
  putCommonFields(*response);
  response->set(http::field::content_type, type);
  response->content_length(text.size());
  if (request.method() != http::verb::head) response->body() = std::move(text);
  send(std::move(response), nullptr);
}

template <class Response>
void HttpSession::send(std::shared_ptr<Response> response, std::shared_ptr<const void> keeper) {
  const bool goes_on =
      parser_->get().keep_alive() && ++served_ < kMostRequests &&
      http::to_status_class(response->result()) != http::status_class::client_error;
  response->keep_alive(goes_on);
  stream_.expires_after(kPatience);
  // The serializer must outlive the write. Answers to HEAD, and answers 304, have a length but no
  // body.
  using Serializer = http::response_serializer<typename Response::body_type>;
  auto serializer = std::make_shared<Serializer>(*response);
  const bool bare = parser_->get().method() == http::verb::head;
  auto done = [self = shared_from_this(), response, serializer, keeper, goes_on](
                  beast::error_code error, std::size_t bytes) {
    self->shared_->bytes_sent += bytes;
    if (error) return;
    if (goes_on) return self->read();
    beast::error_code ignored;
    self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  };
  if (bare) {
    serializer->split(true);
    http::async_write_header(stream_, *serializer, std::move(done));
  } else {
    http::async_write(stream_, *serializer, std::move(done));
  }
}

}  // namespace

void serveHttp(tcp::socket socket, std::shared_ptr<Shared> shared) {
  std::make_shared<HttpSession>(std::move(socket), std::move(shared))->read();
}

}  // namespace perdure::gateway::web
