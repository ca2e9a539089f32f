#include "tests/services/gateway/raw_client.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>

namespace perdure::gateway::test {
namespace {

constexpr int kPatience = 10;  // s; ends a test that would hang

std::uint32_t naturalAt(const std::string& text, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, text.data() + at, sizeof value);
  return value;
}

}  // namespace

RawClient::RawClient(std::uint16_t port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    close(socket_);
    socket_ = -1;
  }
}

RawClient::~RawClient() {
  if (socket_ >= 0) close(socket_);
}

void RawClient::send(std::string_view bytes) const {
  while (!bytes.empty()) {
    const ssize_t n = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (n <= 0) return;
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
}

std::string RawClient::masked(std::string_view payload, std::uint8_t opcode) {
  std::string frame(1, static_cast<char>(0x80 | opcode));
  const std::size_t n = payload.size();
  if (n < 126) {
    frame += static_cast<char>(0x80 | n);
  } else if (n < 65536) {
    frame += static_cast<char>(0x80 | 126);
    frame += static_cast<char>(n >> 8);
    frame += static_cast<char>(n & 0xff);
  } else {
    frame += static_cast<char>(0x80 | 127);
    for (int shift = 56; shift >= 0; shift -= 8) frame += static_cast<char>((n >> shift) & 0xff);
  }
  frame.append(4, '\0');  // a mask of zeros is valid
  return frame.append(payload);
}

void RawClient::sendFrame(std::string_view payload, std::uint8_t opcode) const {
  send(masked(payload, opcode));
}

bool RawClient::fill(int seconds) {
  pollfd wait{socket_, POLLIN, 0};
  if (poll(&wait, 1, 1000 * seconds) <= 0) return false;
  char chunk[65536];
  const ssize_t n = recv(socket_, chunk, sizeof chunk, 0);
  if (n <= 0) return false;
  buffer_.append(chunk, static_cast<std::size_t>(n));
  return true;
}

std::string RawClient::readHead() {
  std::size_t end = 0;
  while ((end = buffer_.find("\r\n\r\n")) == std::string::npos) {
    if (!fill(kPatience)) return {};
  }
  const std::string head = buffer_.substr(0, end + 4);
  buffer_.erase(0, end + 4);
  return head;
}

std::string RawClient::readBody(std::size_t bytes) {
  while (buffer_.size() < bytes && fill(kPatience)) {
  }
  std::string body = buffer_.substr(0, bytes);
  buffer_.erase(0, body.size());
  return body;
}

RawClient::FrameRead RawClient::readFrame() {
  const auto have = [&](std::size_t n) {
    while (buffer_.size() < n) {
      if (!fill(kPatience)) return false;
    }
    return true;
  };
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(buffer_[i]); };
  if (!have(2)) return {0xff, {}};
  std::size_t head = 2, length = byte(1) & 0x7fU;
  const std::size_t more = length == 126 ? 2 : length == 127 ? 8 : 0;
  if (!have(head + more)) return {0xff, {}};
  if (more > 0) length = 0;
  for (std::size_t i = 0; i < more; ++i) length = length << 8U | byte(head + i);
  head += more;
  if (!have(head + length)) return {0xff, {}};
  FrameRead frame{static_cast<std::uint8_t>(byte(0) & 0x0fU), buffer_.substr(head, length)};
  buffer_.erase(0, head + length);
  if (frame.opcode != 9) return frame;
  sendFrame(frame.payload, 10);
  return readFrame();
}

bool RawClient::closed(int seconds) {
  pollfd wait{socket_, POLLIN, 0};
  while (poll(&wait, 1, 1000 * seconds) > 0) {
    char chunk[65536];
    if (recv(socket_, chunk, sizeof chunk, 0) <= 0) return true;
  }
  return false;
}

void RawClient::readSlowly() const {
  const int bytes = 4096;
  setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
}

std::string RawClient::upgrade(const std::string& more, const std::string& protocols,
                               const std::string& host, const std::string& target) {
  send("GET " + target + " HTTP/1.1\r\nHost: " + host +
       "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
       "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
       (protocols.empty() ? "" : "Sec-WebSocket-Protocol: " + protocols + "\r\n") + more + "\r\n");
  return readHead();
}

std::string RawClient::readMessage(std::uint32_t subscription) {
  while (true) {
    const FrameRead frame = readFrame();
    if (frame.opcode == 0xff || frame.opcode == 8) return {};
    const bool message = frame.opcode == 2 && frame.payload.size() >= 13 && frame.payload[0] == 1;
    if (message && naturalAt(frame.payload, 1) == subscription) return frame.payload.substr(13);
  }
}

HttpAnswer get(std::uint16_t port, const std::string& target, const std::string& more,
               const std::string& host) {
  return ask(port, "GET " + target, more, host);
}

HttpAnswer post(std::uint16_t port, const std::string& target, const std::string& body,
                const std::string& more) {
  return ask(port, "POST " + target,
             more + "Content-Length: " + std::to_string(body.size()) + "\r\n", "127.0.0.1", body);
}

HttpAnswer ask(std::uint16_t port, const std::string& line, const std::string& more,
               const std::string& host, const std::string& body) {
  RawClient client(port);
  client.send(line + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n" + more + "\r\n" +
              body);
  const std::string head = client.readHead();
  if (head.size() < 12) return {};
  return {std::stoi(head.substr(9, 3)), head + client.readBody(std::size_t{1} << 24U)};
}

}  // namespace perdure::gateway::test
