#include "tests/services/capture/live/fake_iiod.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <sstream>
#include <stdexcept>

#include "services/capture/live/clocks.h"

namespace perdure::capture::testing {
namespace {

constexpr std::uint16_t kPort = 30431;
constexpr const char *kTrigger = "trigger0", *kRate = "sampling_frequency";
constexpr double kMostTriggers_hz = 500.0;

bool sendAll(int socket, const std::string& bytes) {
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t n = send(socket, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) return false;
    sent += static_cast<std::size_t>(n);
  }
  return true;
}

bool readByte(int socket, char& byte) { return recv(socket, &byte, 1, 0) == 1; }

bool readLine(int socket, std::string& line) {
  line.clear();
  for (char c = 0; readByte(socket, c);) {
    if (c == '\n') return true;
    if (c != '\r') line += c;
  }
  return false;
}

bool sendNumber(int socket, long value) { return sendAll(socket, std::to_string(value) + "\n"); }

bool sendText(int socket, const std::string& text) {
  const std::string whole = text + std::string(1, '\0');
  return sendAll(socket, std::to_string(whole.size()) + "\n" + whole + "\n");
}

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::size_t axesOf(const FakeImu& d) { return (d.gyro ? 3U : 0U) + (d.accel ? 3U : 0U); }

/// The stamp is aligned to eight bytes.
std::size_t scanBytes(const FakeImu& d) {
  return d.stamps ? (2 * axesOf(d) + 7) / 8 * 8 + 8 : 2 * axesOf(d);
}

std::string scan(const FakeImu& d, std::int64_t i, std::int64_t stamp_ns) {
  std::string bytes;
  if (d.gyro) {
    append(bytes, static_cast<std::int16_t>(i % 1000));
    append<std::int16_t>(bytes, -7);
    append<std::int16_t>(bytes, 3);
  }
  if (d.accel) {
    for (const std::int16_t v : {5, -6, 981}) append(bytes, v);
  }
  if (d.stamps) {
    bytes.resize(scanBytes(d) - 8);
    append(bytes, stamp_ns);
  }
  return bytes;
}

}  // namespace

FakeIiod::FakeIiod(std::string address, std::vector<FakeImu> devices)
    : address_(std::move(address)), devices_(std::move(devices)), start_ns_(HostClock::nowNs()) {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(kPort);
  inet_pton(AF_INET, address_.c_str(), &at.sin_addr);
  if (bind(listener_, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0 || listen(listener_, 8)) {
    throw std::runtime_error("no socket at " + address_ + ": " + std::strerror(errno));
  }
  thread_ = std::thread([this] { serve(); });
}

FakeIiod::~FakeIiod() {
  stopping_ = true;
  shutdown(listener_, SHUT_RDWR);
  thread_.join();
  {
    const std::lock_guard lock(mutex_);
    for (const int socket : sockets_) shutdown(socket, SHUT_RDWR);
  }
  for (auto& talk : talks_) talk.join();
  for (const int socket : sockets_) close(socket);
  close(listener_);
}

std::string FakeIiod::triggerSet() const {
  const std::lock_guard lock(mutex_);
  return trigger_;
}

void FakeIiod::serve() {
  while (!stopping_) {
    const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) continue;
    const int on = 1;
    setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    const std::lock_guard lock(mutex_);
    sockets_.push_back(client);
    talks_.emplace_back([this, client] { talk(client); });
  }
}

void FakeIiod::talk(int socket) {
  std::vector<std::int64_t> next(devices_.size(), -1);
  std::string line;
  while (!stopping_ && readLine(socket, line)) {
    if (silent_) continue;
    if (!answer(socket, line, next)) return;
  }
}

const FakeImu* FakeIiod::find(const std::string& id) const {
  for (const auto& d : devices_) {
    if (d.id == id) return &d;
  }
  return nullptr;
}

bool FakeIiod::answer(int socket, const std::string& line, std::vector<std::int64_t>& next) {
  std::istringstream words(line);
  std::string verb, id;
  words >> verb >> id;
  if (verb == "VERSION") return sendAll(socket, "0.24.0000000\n");
  if (verb == "PRINT") {
    const std::string text = xml();
    return sendAll(socket, std::to_string(text.size()) + "\n" + text + "\n");
  }
  if (verb == "TIMEOUT" || verb == "SET" || verb == "CLOSE") return sendNumber(socket, 0);
  if (verb == "EXIT") return false;
  std::string rest;
  std::getline(words >> std::ws, rest);
  if (verb == "READ") return answerRead(socket, id, rest);
  if (verb == "WRITE") return answerWrite(socket, id, rest);
  const FakeImu* device = find(id);
  if (!device) return sendNumber(socket, verb == "ZPRINT" ? -EINVAL : -ENODEV);
  auto& at = next[static_cast<std::size_t>(device - devices_.data())];
  if (verb == "OPEN") {
    if (device->needs_trigger && triggerSet().empty()) return sendNumber(socket, -EINVAL);
    const double since_s = 1e-9 * static_cast<double>(HostClock::nowNs() - start_ns_);
    at = static_cast<std::int64_t>(since_s * rateOf(*device));
    return sendNumber(socket, 0);
  }
  if (verb == "READBUF") return sendScans(socket, *device, std::stoul(rest), at);
  if (verb == "SETTRIG") {
    const std::lock_guard lock(mutex_);
    trigger_ = rest;
    return sendNumber(socket, 0);
  }
  return sendNumber(socket, -EINVAL);
}

bool FakeIiod::answerRead(int socket, const std::string& id, const std::string& what) {
  if (id == kTrigger && what == kRate) return sendText(socket, fmt::format("{}\n", triggerRate()));
  const FakeImu* device = find(id);
  if (!device) return sendNumber(socket, -ENODEV);
  if (what.find("accel_") != std::string::npos && what.ends_with("scale")) {
    return sendText(socket, "0.01\n");
  }
  if (what.ends_with("scale")) return sendText(socket, "0.001\n");
  if (what == kRate) return sendText(socket, fmt::format("{}\n", device->rate_hz));
  if (what == (device->shared_mount ? "INPUT mount matrix" : "mount_matrix")) {
    return sendText(socket, device->mount + "\n");
  }
  return sendNumber(socket, -ENOENT);
}

bool FakeIiod::answerWrite(int socket, const std::string& id, const std::string& what) {
  const auto length = std::stoul(what.substr(what.rfind(' ') + 1));
  std::string value;
  for (char c = 0; value.size() < length && readByte(socket, c);) value += c;
  if (what.starts_with(kRate)) {
    const double rate_hz = std::strtod(value.c_str(), nullptr);
    if (id == kTrigger) {
      trigger_rate_ = std::min(rate_hz, kMostTriggers_hz);
    } else {
      rate_asked_ = rate_hz;
    }
  }
  return sendNumber(socket, static_cast<long>(length));
}

double FakeIiod::rateOf(const FakeImu& device) const {
  return device.needs_trigger ? triggerRate() : device.rate_hz;
}

/// Sends a block as soon as its last scan exists.
bool FakeIiod::sendScans(int socket, const FakeImu& device, std::size_t bytes, std::int64_t& next) {
  const std::size_t scans = bytes / scanBytes(device);
  std::string data;
  std::int64_t made_ns = 0;
  for (std::size_t i = 0; i < scans; ++i, ++next) {
    made_ns =
        start_ns_ + static_cast<std::int64_t>(1e9 * static_cast<double>(next) / rateOf(device));
    const std::int64_t read_ns = device.frozen_clock ? start_ns_ : made_ns;
    data += scan(device, next, read_ns + device.clock_ns + step_ns_);
  }
  while (HostClock::nowNs() < made_ns && !stopping_) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (silent_) return true;
  const unsigned channels = static_cast<unsigned>(axesOf(device)) + (device.stamps ? 1 : 0);
  return sendAll(socket, fmt::format("{}\n{:08x}\n", data.size(), (1U << channels) - 1)) &&
         sendAll(socket, data);
}

std::string FakeIiod::xml() const {
  std::string text =
      R"(<?xml version="1.0" encoding="utf-8"?><!DOCTYPE context [<!ELEMENT context (device)*>)"
      "<!ELEMENT device (channel | attribute)*><!ELEMENT channel (scan-element?, attribute*)>"
      "<!ELEMENT attribute EMPTY><!ELEMENT scan-element EMPTY>"
      "<!ATTLIST context name CDATA #REQUIRED>"
      "<!ATTLIST device id CDATA #REQUIRED name CDATA #IMPLIED>"
      "<!ATTLIST channel id CDATA #REQUIRED type (input|output) #REQUIRED>"
      "<!ATTLIST scan-element index CDATA #REQUIRED format CDATA #REQUIRED>"
      "<!ATTLIST attribute name CDATA #REQUIRED filename CDATA #IMPLIED>]>"
      R"(<context name="local">)";
  for (const FakeImu& d : devices_) {
    text += fmt::format(R"(<device id="{}" name="{}">)", d.id, d.name);
    int index = 0;
    const auto axes = [&](const char* kind) {
      for (const char axis : {'x', 'y', 'z'}) {
        text += fmt::format(
            R"(<channel id="{0}_{1}" type="input"><scan-element index="{2}" )"
            R"(format="le:S16/16&gt;&gt;0" /><attribute name="scale" filename="in_{0}_scale" />)"
            "</channel>",
            kind, axis, index++);
      }
    };
    if (d.gyro) axes("anglvel");
    if (d.accel) axes("accel");
    if (d.stamps) {
      text += fmt::format(R"(<channel id="timestamp" type="input"><scan-element index="{}" )"
                          R"(format="le:S64/64&gt;&gt;0" /></channel>)",
                          index);
    }
    text += R"(<attribute name="sampling_frequency" />)";
    if (d.shared_mount) {
      text += R"(<channel id="mount" type="input"><attribute name="matrix" )"
              R"(filename="in_mount_matrix" /></channel>)";
    } else if (!d.mount.empty()) {
      text += R"(<attribute name="mount_matrix" />)";
    }
    text += "</device>";
  }
  text += R"(<device id="trigger0" name="hrtimer"><attribute name="sampling_frequency" />)"
          "</device></context>";
  return text;
}

}  // namespace perdure::capture::testing
