// A client on a bare socket, which can violate the protocol unlike a library: half a request, a
// frame with a wrong length, silence.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace perdure::gateway::test {

class RawClient {
 public:
  explicit RawClient(std::uint16_t port);
  ~RawClient();
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  void send(std::string_view bytes) const;
  /// Returns a masked client frame. `opcode`: 1 text, 2 binary, 8 close, 9 ping.
  static std::string masked(std::string_view payload, std::uint8_t opcode = 1);
  void sendFrame(std::string_view payload, std::uint8_t opcode = 1) const;
  /// Reads up to and including the empty line; empty if the peer closes earlier or is silent.
  std::string readHead();
  std::string readBody(std::size_t bytes);

  struct FrameRead {
    std::uint8_t opcode = 0;
    std::string payload;
  };
  /// Reads the next frame and answers pings; opcode 0xff if the connection has ended or nothing
  /// arrives.
  FrameRead readFrame();
  /// Waits until the peer closes; returns false if it does not within `seconds`.
  bool closed(int seconds);
  /// Uses small buffers, so that unread data soon block the peer.
  void readSlowly() const;

  /// Upgrades the connection; returns the head of the answer.
  std::string upgrade(const std::string& more = "Origin: http://127.0.0.1:1\r\n",
                      const std::string& protocols = "foxglove.websocket.v1",
                      const std::string& host = "127.0.0.1:1", const std::string& target = "/");
  /// Reads frames up to a message of the subscription; returns its payload.
  std::string readMessage(std::uint32_t subscription);

 private:
  bool fill(int seconds);
  int socket_;
  std::string buffer_;
};

/// Status, head and body of the answer to one request.
struct HttpAnswer {
  int status = 0;
  std::string text;
};
HttpAnswer get(std::uint16_t port, const std::string& target, const std::string& more = "",
               const std::string& host = "127.0.0.1");
HttpAnswer post(std::uint16_t port, const std::string& target, const std::string& body,
                const std::string& more = "");
/// `line`: method and target.
HttpAnswer ask(std::uint16_t port, const std::string& line, const std::string& more,
               const std::string& host, const std::string& body = "");

}  // namespace perdure::gateway::test
