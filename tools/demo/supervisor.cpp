#include "tools/demo/supervisor.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <regex>
#include <sstream>
#include <thread>

#include "common/base/errors.h"
#include "tools/base/files.h"
#include "tools/demo/plan.h"

namespace perdure::tools {
namespace {

constexpr std::chrono::seconds kPatienceAtEnd{15};

/// The text of <value><TYPE>…</TYPE></value> after <name>`name`</name>.
std::string member(const std::string& xml, const std::string& name) {
  const auto at = xml.find("<name>" + name + "</name>");
  if (at == std::string::npos) return {};
  const auto value = xml.find("<value>", at);
  if (value == std::string::npos) return {};
  const auto type_end = xml.find('>', value + 7);
  if (type_end == std::string::npos) return {};
  const auto end = xml.find('<', type_end + 1);
  return end == std::string::npos ? std::string() : xml.substr(type_end + 1, end - type_end - 1);
}

[[noreturn]] void throwUnusable(const std::string& why) {
  throw StartupError(ExitCode::kUnavailable, why);
}

class Socket {
 public:
  explicit Socket(const std::string& path) : fd_(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    const timeval patience{.tv_sec = 2, .tv_usec = 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    open_ = connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~Socket() { close(fd_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  bool isOpen() const { return open_; }
  bool send(const std::string& text) const {
    return ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  std::string receiveAll() const {
    std::string text;
    char buffer[4096];
    for (ssize_t n = 0; (n = recv(fd_, buffer, sizeof buffer, 0)) > 0;) {
      text.append(buffer, static_cast<std::size_t>(n));
      if (text.find("</methodResponse>") != std::string::npos) break;
    }
    return text;
  }

 private:
  int fd_;
  bool open_ = false;
};

}  // namespace

std::map<std::string, ServiceState> readProcessInfo(const std::string& xml) {
  std::map<std::string, ServiceState> states;
  for (auto at = xml.find("<struct>"); at != std::string::npos;) {
    const auto end = xml.find("</struct>", at);
    if (end == std::string::npos) break;
    const std::string one = xml.substr(at, end - at);
    if (const std::string name = member(one, "name"); !name.empty()) {
      states[name] = {member(one, "statename"), member(one, "spawnerr")};
    }
    at = xml.find("<struct>", end);
  }
  return states;
}

std::map<std::string, int> countSpawns(const std::string& log) {
  std::map<std::string, int> counts;
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    constexpr std::string_view kSpawned = "spawned: '";
    const auto at = line.find(kSpawned);
    if (at == std::string::npos) continue;
    const auto begin = at + kSpawned.size();
    ++counts[line.substr(begin, line.find('\'', begin) - begin)];
  }
  return counts;
}

std::map<std::string, int> lastExits(const std::string& log) {
  static const std::regex pattern("exited: ([^ ]+) \\(exit status ([0-9]+)");
  std::map<std::string, int> exits;
  for (std::sregex_iterator it(log.begin(), log.end(), pattern), end; it != end; ++it) {
    exits[(*it)[1]] = std::stoi((*it)[2]);
  }
  return exits;
}

std::string complaintIn(const std::string& output) {
  std::istringstream lines(output);
  std::string last;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("Error: ")) return line;
    if (!line.empty()) last = line;
  }
  return last;
}

Supervisor::Supervisor(const std::string& config_file, const std::string& socket,
                       const std::string& log)
    : socket_(socket) {
  if (!findProgram("supervisord")) {
    throwUnusable("supervisord is missing; install it with deploy/install --runtime");
  }
  // Runs in its own session, so that only this program receives Ctrl-C.
  process_.emplace(ProgramOptions{.command = {"supervisord", "-n", "-c", config_file},
                                  .environment = kSupervisorEnvironment,
                                  .log = log,
                                  .own_session = true,
                                  .ends_with_parent = true});
  constexpr std::chrono::seconds kPatience{20};
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!states()) {
    const bool ended = !alive();
    if (ended || std::chrono::steady_clock::now() >= end) {
      process_->stop(kPatienceAtEnd);
      const std::string words = ended ? complaintIn(textOf(log)) : std::string();
      throwUnusable("supervisord " + std::string(ended ? "ended at once" : "does not answer") +
                    (words.empty() ? "" : ": " + words) + "; see " + log);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

Supervisor::~Supervisor() { process_->stop(kPatienceAtEnd); }

bool Supervisor::alive() { return !process_->ended(); }

Result<std::string> Supervisor::call(const std::string& method,
                                     const std::string& parameters) const {
  const Socket connection(socket_);
  if (!connection.isOpen()) return fail("no_supervisor", socket_);
  const std::string body = "<?xml version=\"1.0\"?><methodCall><methodName>supervisor." + method +
                           "</methodName><params>" + parameters + "</params></methodCall>";
  const std::string head =
      "POST /RPC2 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
      "Content-Type: text/xml\r\nContent-Length: " +
      std::to_string(body.size()) + "\r\n\r\n";
  if (!connection.send(head + body)) return fail("no_supervisor", socket_);
  const std::string answer = connection.receiveAll();
  if (answer.find("</methodResponse>") == std::string::npos) return fail("no_answer", answer);
  return answer;
}

Result<std::map<std::string, ServiceState>> Supervisor::states() const {
  const auto answer = call("getAllProcessInfo", "");
  if (!answer) return tl::unexpected<Reason>(answer.error());
  return readProcessInfo(*answer);
}

void Supervisor::stop(const std::string& service) const {
  (void)call("stopProcess", "<param><value><string>" + service +
                                "</string></value></param><param><value><boolean>0</boolean>"
                                "</value></param>");
}

}  // namespace perdure::tools
