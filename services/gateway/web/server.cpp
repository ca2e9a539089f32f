#include "services/gateway/web/server.h"

#include <atomic>
#include <mutex>
#include <thread>

#include "common/base/errors.h"
#include "services/gateway/web/shared.h"

namespace perdure::gateway::web {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kMostPosted = 2000;  // limit of messages that wait for the server's thread

tcp::endpoint endpointOf(const Options& options) {
  beast::error_code error;
  const std::string name = options.address == "localhost" ? "127.0.0.1" : options.address;
  const auto address = asio::ip::make_address(name, error);
  if (error) {
    throw StartupError(ExitCode::kConfiguration,
                       "http.address " + options.address + " is no address; give one as 127.0.0.1");
  }
  return {address, static_cast<unsigned short>(options.port)};
}

}  // namespace

class Server::Impl {
 public:
  Impl(const Options& options, Content content, Hub::Told told)
      : shared_(std::make_shared<Shared>(
            Shared{options,
                   Guard(options),
                   std::move(content.files),
                   Hub(content.name, content.session, static_cast<std::size_t>(options.most_events),
                       std::move(told)),
                   {},
                   {},
                   {},
                   0,
                   0,
                   0,
                   {},
                   std::move(content.ask),
                   {},
                   0})),
        acceptor_(io_),
        beat_(io_) {
    shared_->hub.offer(std::move(content.channels), std::move(content.services), content.range);
    shared_->healthz = R"({"status":"starting"})";
    shared_->texts_at = Clock::now();
    listen();
    accept();
    beat();
    thread_ = std::thread([this] { io_.run(); });
  }

  ~Impl() {
    asio::post(io_, [this] {
      beast::error_code ignored;
      acceptor_.close(ignored);
      beat_.cancel();
      for (Connection* one : shared_->connections) one->end();
      shared_->replies.clear();
      io_.stop();
    });
    thread_.join();
  }

  std::uint16_t port() const { return port_; }

  /// Runs `work` in the server's thread. Returns false, without running it, if too much work waits.
  template <class Work>
  bool post(Work work) {
    if (posted_ >= kMostPosted) return false;
    ++posted_;
    asio::post(io_, [this, work = std::move(work)]() mutable {
      --posted_;
      work(*shared_);
    });
    return true;
  }

  Stats stats() const {
    const std::lock_guard lock(mutex_);
    return stats_;
  }
  bool goesOn() const {
    constexpr std::chrono::seconds kLongest{5};
    return Clock::now().time_since_epoch() - Clock::duration(last_beat_.load()) < kLongest;
  }

 private:
  void listen() {
    const tcp::endpoint endpoint = endpointOf(shared_->options);
    beast::error_code error;
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (error) {
      throw StartupError(ExitCode::kUnavailable,
                         "the gateway cannot listen on " + shared_->options.address + " port " +
                             std::to_string(shared_->options.port) + ": " + error.message() +
                             "; set http.port to another one");
    }
    port_ = acceptor_.local_endpoint().port();
  }

  void accept() {
    acceptor_.async_accept([this](beast::error_code error, tcp::socket socket) {
      if (!acceptor_.is_open()) return;
      if (error) {
        // If the process has no free descriptors, waits until other connections have ended.
        shared_->hub.reasons().add("accept_failed");
        constexpr std::chrono::milliseconds kPause{100};
        auto pause = std::make_shared<asio::steady_timer>(io_, kPause);
        pause->async_wait([this, pause](beast::error_code) { accept(); });
        return;
      }
      const auto most = static_cast<std::size_t>(shared_->options.most_connections);
      if (shared_->connections.size() >= most) {
        shared_->hub.reasons().add("too_many_connections");
        beast::error_code ignored;
        socket.close(ignored);
      } else {
        serveHttp(std::move(socket), shared_);
      }
      accept();
    });
  }

  void beat() {
    last_beat_ = Clock::now().time_since_epoch().count();
    {
      const std::lock_guard lock(mutex_);
      stats_ = {shared_->hub.clients(), shared_->connections.size(), shared_->bytes_sent,
                shared_->messages_sent, shared_->hub.published(),    shared_->hub.dropped(),
                shared_->requests,      shared_->hub.reasons()};
    }
    beat_.expires_after(std::chrono::seconds(1));
    beat_.async_wait([this](beast::error_code error) {
      if (!error) beat();
    });
  }

  asio::io_context io_{1};
  std::shared_ptr<Shared> shared_;
  tcp::acceptor acceptor_;
  asio::steady_timer beat_;
  std::uint16_t port_ = 0;
  std::atomic<int> posted_{0};
  std::atomic<Clock::rep> last_beat_{0};
  mutable std::mutex mutex_;
  Stats stats_;
  std::thread thread_;
};

Server::Server(const Options& options, Content content, Hub::Told told)
    : impl_(std::make_unique<Impl>(options, std::move(content), std::move(told))) {}
Server::~Server() = default;

std::uint16_t Server::port() const { return impl_->port(); }

void Server::publish(Encoded message) {
  (void)impl_->post(
      [message = std::move(message)](Shared& shared) { shared.hub.publish(message); });
}

void Server::tellTime(TimePoint time) {
  (void)impl_->post([time](Shared& shared) { shared.hub.tellTime(time); });
}

void Server::answer(Answer answer) {
  (void)impl_->post([answer = std::move(answer)](Shared& shared) { shared.hub.answer(answer); });
}

void Server::reply(std::uint64_t question, int status, std::string text) {
  (void)impl_->post([question, status, text = std::move(text)](Shared& shared) {
    const auto reply = shared.replies.extract(question);
    if (!reply.empty()) reply.mapped()(status, text);
  });
}

void Server::tellPlayback(PlaybackState state) {
  (void)impl_->post([state = std::move(state)](Shared& shared) { shared.hub.tellPlayback(state); });
}

void Server::setTexts(std::string healthz, std::string metrics) {
  (void)impl_->post([healthz = std::move(healthz), metrics = std::move(metrics)](Shared& shared) {
    shared.healthz = healthz;
    shared.metrics = metrics;
    shared.texts_at = Clock::now();
  });
}

Stats Server::stats() const { return impl_->stats(); }
bool Server::goesOn() const { return impl_->goesOn(); }

}  // namespace perdure::gateway::web
