// A client made of a bare socket, which can do what no library does: half a request, a frame that
// lies about its length, silence.
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
  /// A frame as a client has to mask it. `opcode`: 1 text, 2 binary, 8 close, 9 ping.
  static std::string masked(std::string_view payload, std::uint8_t opcode = 1);
  void sendFrame(std::string_view payload, std::uint8_t opcode = 1) const;
  /// Up to and with the empty line; empty where the other side closes before, or is silent.
  std::string readHead();
  std::string readBody(std::size_t bytes);

  struct FrameRead {
    std::uint8_t opcode = 0;
    std::string payload;
  };
  /// The next frame, pings answered; opcode 0xff where the connection has ended or nothing comes.
  FrameRead readFrame();
  /// Until the other side closes; false where it does not within the patience.
  bool closed(int seconds);
  /// Small buffers, so that what is not read is soon in the other's way.
  void readSlowly() const;

  /// Upgrades; the answer's head.
  std::string upgrade(const std::string& more = "Origin: http://127.0.0.1:1\r\n",
                      const std::string& protocols = "foxglove.websocket.v1",
                      const std::string& host = "127.0.0.1:1", const std::string& target = "/");
  /// Reads frames until one is a message of the subscription, whose payload it returns.
  std::string readMessage(std::uint32_t subscription);

 private:
  bool fill(int seconds);
  int socket_;
  std::string buffer_;
};

/// {status, head + body} of one request.
struct HttpAnswer {
  int status = 0;
  std::string text;
};
HttpAnswer get(std::uint16_t port, const std::string& target, const std::string& more = "",
               const std::string& host = "127.0.0.1");

}  // namespace perdure::gateway::test
