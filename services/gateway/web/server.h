// The gateway's server. One port has HTTP (the page, /healthz, /metrics) and the Foxglove WebSocket
// protocol. One thread serves all clients. All functions may be called from any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "services/gateway/core/channels.h"
#include "services/gateway/web/files.h"
#include "services/gateway/web/guard.h"
#include "services/gateway/web/hub.h"

namespace perdure::gateway::web {

struct Content {
  std::string name, session;  ///< sent to clients in serverInfo
  std::vector<ChannelInfo> channels;
  std::vector<ServiceInfo> services;
  Files files;
  std::optional<TimeRange> range = std::nullopt;  ///< time range, if clients control a
                                                  ///< recording
  Ask ask = {};  ///< MCP; each message must get a reply. Empty: /mcp does not exist
};

struct Stats {
  std::size_t clients = 0, connections = 0;
  std::uint64_t bytes_sent = 0, messages_sent = 0, published = 0, dropped = 0, requests = 0;
  ReasonCounts reasons;  ///< reasons of refused or closed connections
};

class Server {
 public:
  /// Opens the port and starts the thread, in which `told` is called. Throws StartupError (69) if
  /// the port is in use.
  Server(const Options& options, Content content, Hub::Told told);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;
  void publish(Encoded message);
  void tellTime(TimePoint time);
  void answer(Answer answer);
  /// Answers the message of an MCP client. `status` is that of HTTP.
  void reply(std::uint64_t question, int status, std::string text);
  void tellPlayback(PlaybackState state);
  void setTexts(std::string healthz, std::string metrics);
  Stats stats() const;
  /// Returns false if the server's thread has not run for some seconds.
  bool goesOn() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace perdure::gateway::web
