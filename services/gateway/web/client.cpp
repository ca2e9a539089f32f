// One WebSocket client. Its waiting messages are written one at a time.
#include <array>

#include "services/gateway/web/shared.h"

namespace perdure::gateway::web {
namespace {

/// Closes a connection without waiting until the client has closed its side. Beast's own teardown
/// waits for up to the timeout of a handshake, and then loses the client's error.
class Wire : public beast::tcp_stream {
 public:
  explicit Wire(beast::tcp_stream stream) : beast::tcp_stream(std::move(stream)) {}

  template <class Handler>
  friend void async_teardown(beast::role_type, Wire& wire, Handler&& handler) {
    beast::error_code error;
    wire.socket().shutdown(tcp::socket::shutdown_send, error);
    asio::post(wire.get_executor(),
               beast::bind_front_handler(std::forward<Handler>(handler), beast::error_code()));
  }
  friend void teardown(beast::role_type, Wire& wire, beast::error_code& error) {
    wire.socket().shutdown(tcp::socket::shutdown_send, error);
  }
};

class Client : public Viewer, public Connection, public std::enable_shared_from_this<Client> {
 public:
  Client(beast::tcp_stream stream, std::shared_ptr<Shared> shared)
      : Viewer(static_cast<std::size_t>(shared->options.most_events)),
        socket_(std::move(stream)),
        shared_(std::move(shared)) {
    shared_->connections.insert(this);
  }
  ~Client() override { shared_->connections.erase(this); }

  void accept(Request request, const std::string& protocol);
  void flush() override;
  void cut(const std::string& why) override;
  void end() override {
    beast::error_code ignored;
    beast::get_lowest_layer(socket_).socket().close(ignored);
  }

 private:
  void onAccepted(beast::error_code error);
  void read();
  void onRead(beast::error_code error);
  void write();
  void onWritten(beast::error_code error, std::size_t bytes);
  void noteEnd(beast::error_code error);

  websocket::stream<Wire> socket_;
  beast::flat_buffer said_;
  std::shared_ptr<Shared> shared_;
  Outgoing sending_;
  bool plays_ = false, joined_ = false, writing_ = false, cut_ = false;
};

void Client::accept(Request request, const std::string& protocol) {
  plays_ = protocol == gateway::protocol::kSubprotocols.front();
  beast::get_lowest_layer(socket_).expires_never();
  auto timeouts = websocket::stream_base::timeout::suggested(beast::role_type::server);
  timeouts.handshake_timeout = std::chrono::seconds(10);
  timeouts.idle_timeout = std::chrono::seconds(30);
  timeouts.keep_alive_pings = true;
  socket_.set_option(timeouts);
  socket_.set_option(websocket::stream_base::decorator([protocol](websocket::response_type& r) {
    r.set(http::field::server, "perdure-gateway");
    r.set(http::field::sec_websocket_protocol, protocol);
  }));
  socket_.read_message_max(static_cast<std::size_t>(shared_->options.most_message_kb) << 10U);
  socket_.auto_fragment(false);
  websocket::permessage_deflate compression;  // for clients that ask for it
  compression.server_enable = true;
  compression.compLevel = 1;                // the least cost
  compression.server_max_window_bits = 12;  // 24 KiB of buffers per client, not 136
  socket_.set_option(compression);
  auto kept = std::make_shared<Request>(std::move(request));
  socket_.async_accept(*kept, [self = shared_from_this(), kept](beast::error_code error) {
    self->onAccepted(error);
  });
}

void Client::onAccepted(beast::error_code error) {
  if (error) return shared_->hub.reasons().add("handshake_failed");
  joined_ = true;
  beast::error_code ignored;
  beast::get_lowest_layer(socket_).socket().set_option(tcp::no_delay(true), ignored);
  shared_->hub.join(*this, plays_);
  read();
}

void Client::read() {
  socket_.async_read(said_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    self->onRead(error);
  });
}

void Client::onRead(beast::error_code error) {
  if (error) return noteEnd(error);
  const auto data = said_.cdata();
  shared_->hub.hear(*this, {static_cast<const char*>(data.data()), data.size()}, socket_.got_text(),
                    std::chrono::steady_clock::now());
  said_.consume(said_.size());
  if (!cut_) read();
}

/// Removes the client from the hub after the first failure of a read or write. Later failures have
/// no effect.
void Client::noteEnd(beast::error_code error) {
  if (!joined_) return;
  joined_ = false;
  if (error == websocket::error::message_too_big) {
    shared_->hub.reasons().add("client_cut_message_too_large");
  } else if (error == beast::error::timeout) {
    shared_->hub.reasons().add("client_cut_silent");
  } else if (error.category() == make_error_code(websocket::error::bad_opcode).category() &&
             error != websocket::error::closed) {
    shared_->hub.reasons().add("client_cut_protocol_violated");
  }
  shared_->hub.leave(*this);
  end();
}

void Client::flush() {
  if (joined_ && !writing_ && !cut_) write();
}

void Client::write() {
  if (const std::uint64_t lost = outbox().takeLostEvents(); lost > 0) {
    (void)outbox().putControl(
        protocol::status(protocol::StatusLevel::kWarning,
                         std::to_string(lost) + " events were lost: this client reads slowly"),
        true);
  }
  auto next = outbox().take();
  if (!next) return;
  writing_ = true;
  sending_ = std::move(*next);
  socket_.text(sending_.text);
  const std::array<asio::const_buffer, 2> buffers{
      asio::buffer(sending_.head.data(), sending_.has_head ? sending_.head.size() : 0),
      asio::buffer(*sending_.payload)};
  socket_.async_write(buffers,
                      [self = shared_from_this()](beast::error_code error, std::size_t bytes) {
                        self->onWritten(error, bytes);
                      });
}

void Client::onWritten(beast::error_code error, std::size_t bytes) {
  writing_ = false;
  sending_.payload.reset();
  if (error) return noteEnd(error);
  shared_->bytes_sent += bytes;
  ++shared_->messages_sent;
  flush();
}

/// Closes the connection without a close frame, which would wait behind unread data. The pending
/// read then fails.
void Client::cut(const std::string&) {
  if (cut_) return;
  cut_ = true;
  asio::post(socket_.get_executor(),
             [self = shared_from_this()] { self->noteEnd(asio::error::operation_aborted); });
}

}  // namespace

void serveClient(beast::tcp_stream stream, Request request, std::string protocol,
                 std::shared_ptr<Shared> shared) {
  std::make_shared<Client>(std::move(stream), std::move(shared))
      ->accept(std::move(request), protocol);
}

}  // namespace perdure::gateway::web
