#include "tests/services/map_store/fleet/wire.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>

namespace perdure::map_store::test {
namespace {

sockaddr_in local(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

int listenSomewhere(int& port) {
  const int file = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = local(0);
  socklen_t size = sizeof address;
  if (bind(file, reinterpret_cast<sockaddr*>(&address), size) != 0 || listen(file, 16) != 0 ||
      getsockname(file, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw std::runtime_error("no free port");
  }
  port = ntohs(address.sin_port);
  return file;
}

bool readable(int file, int milliseconds) {
  pollfd one{file, POLLIN, 0};
  return poll(&one, 1, milliseconds) > 0;
}

bool sendAll(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(file, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

}  // namespace

SilentPort::SilentPort() : file_(listenSomewhere(port_)) {}
SilentPort::~SilentPort() { close(file_); }

Relay::Relay(int to_port)
    : listener_(listenSomewhere(port_)), to_port_(to_port), thread_([this] { run(); }) {}

Relay::~Relay() {
  ending_ = true;
  thread_.join();
  close(listener_);
}

void Relay::run() {
  while (!ending_) {
    if (!readable(listener_, 5)) continue;
    const int client = accept(listener_, nullptr, nullptr);
    cut_ = false;
    carry(client);
    close(client);
  }
}

/// Handles one connection after the other, because a vehicle has only one.
void Relay::carry(int client) {
  const int server = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = local(to_port_);
  bool open = connect(server, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  bool deaf = false;
  std::string asked, answered;  // the last bytes from each side
  const auto take = [](int file, std::string& last) {
    std::array<char, 16384> buffer;
    const ssize_t got = recv(file, buffer.data(), buffer.size(), 0);
    const std::size_t size = static_cast<std::size_t>(std::max<ssize_t>(got, 0));
    last = last.substr(last.size() - std::min<std::size_t>(last.size(), 5));
    last.append(buffer.data(), size);
    return std::string(buffer.data(), size);
  };
  while (open && !ending_ && !cut_) {
    if (hanging_) {
      usleep(5000);
      continue;
    }
    std::array<pollfd, 2> files = {pollfd{client, POLLIN, 0}, pollfd{server, POLLIN, 0}};
    if (poll(files.data(), 2, 5) <= 0) continue;
    if (delay_us_ > 0) usleep(static_cast<useconds_t>(delay_us_));
    if (files[0].revents != 0) {
      const std::string bytes = take(client, asked);
      if (lose_answer_ && asked.find("COMMIT") != std::string::npos) {
        lose_answer_ = false;
        deaf = true;
      }
      open = !bytes.empty() && sendAll(server, bytes);
    }
    if (open && files[1].revents != 0) {
      const std::string bytes = take(server, answered);
      open = !bytes.empty() && (deaf || sendAll(client, bytes));
      // The commit was done, but its answer is lost.
      if (deaf && answered.find("COMMIT") != std::string::npos) lost_an_answer_ = true;
      open = open && !(deaf && lost_an_answer_);
    }
  }
  close(server);
}

}  // namespace perdure::map_store::test
