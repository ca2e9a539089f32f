#include "tests/process/support.h"

#include <fcntl.h>
#include <net/if.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace perdure::test {
namespace {

namespace fs = std::filesystem;

bool raiseLoopback() {
  const int socket_fd = socket(AF_INET, SOCK_DGRAM, 0);
  if (socket_fd < 0) return false;
  ifreq request{};
  std::strncpy(request.ifr_name, "lo", IFNAMSIZ - 1);
  request.ifr_flags = IFF_UP | IFF_RUNNING;
  const bool up = ioctl(socket_fd, SIOCSIFFLAGS, &request) == 0;
  close(socket_fd);
  return up;
}

/// The lock is held until this process ends.
std::int64_t leaseDomain() {
  constexpr int kFirst = 100, kLast = 220;
  for (int domain = kFirst; domain <= kLast; ++domain) {
    const auto path = fs::temp_directory_path() / ("perdure-domain-" + std::to_string(domain));
    const int file = open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
    if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) == 0) return domain;
    if (file >= 0) close(file);
  }
  throw std::runtime_error("every DDS domain from 100 to 220 is leased by a test");
}

bus::Options makeNetwork() {
  bus::Options options;
  if (unshare(CLONE_NEWNET) != 0 || !raiseLoopback()) options.domain = leaseDomain();
  setenv("PERDURE_DOMAIN", std::to_string(options.domain).c_str(), 1);
  return options;
}

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  if (value == nullptr) throw std::runtime_error(std::string(name) + " is not set: run by ctest");
  return value;
}

const std::string& emptied(const std::string& file) {
  std::ofstream{file};
  return file;
}

}  // namespace

const bus::Options& ownNetwork() {
  static const bus::Options options = makeNetwork();
  return options;
}

bool ownFiles() {
  static const bool own =
      unshare(CLONE_NEWNS) == 0 && mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
      mount("own", "/tmp", "tmpfs", 0, nullptr) == 0 &&
      mount("own", "/dev/shm", "tmpfs", 0, nullptr) == 0 && fs::exists(programs());
  return own;
}

fs::path programs() { return environment("PERDURE_BIN"); }
fs::path sources() { return environment("PERDURE_SOURCE"); }

fs::path data(const std::string& name) {
  const fs::path path = sources() / ".." / "shared" / "data" / name;
  return fs::exists(path) ? fs::canonical(path) : fs::path();
}

Folder::Folder() {
  std::string name = (fs::temp_directory_path() / "perdure-process-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  path_ = name;
}

Folder::~Folder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

Child::Child(std::vector<std::string> command, std::string log)
    : log_(std::move(log)),
      process_({.command = std::move(command), .log = emptied(log_), .ends_with_parent = true}) {}

int Child::wait(std::chrono::milliseconds longest) { return process_.wait(longest).value_or(-1); }

std::string Child::log() const { return contentsOf(log_); }

bool eventually(std::chrono::milliseconds longest, const std::function<bool()>& so) {
  const auto end = std::chrono::steady_clock::now() + longest;
  while (!so()) {
    if (std::chrono::steady_clock::now() >= end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

std::string contentsOf(const fs::path& file) {
  std::ifstream stream(file);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

}  // namespace perdure::test
