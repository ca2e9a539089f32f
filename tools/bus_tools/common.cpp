#include "tools/bus_tools/common.h"

#include <CLI/CLI.hpp>

#include "common/base/errors.h"
#include "common/service/signals.h"

namespace perdure::tools {

void addBusOptions(CLI::App& command, bus::Options& options) {
  // Reads bus.yaml before the command line is parsed, so that options override the file.
  command.preparse_callback([&options](std::size_t) { options = listenersOptions(); });
  command.add_option("--interface", options.interface, "network interface of the topics")
      ->capture_default_str();
  command.add_option("--peers", options.peers, "addresses of other hosts, without multicast");
  command.add_option("--domain", options.domain, "DDS domain (PERDURE_DOMAIN overrides it)")
      ->check(CLI::Range(0, bus::kMaxDomain))
      ->capture_default_str();
  command.add_option("--vehicle", options.vehicle, "the vehicle's name")->capture_default_str();
  command.add_option("--security", options.security, "folder of the identities (bus.security)");
  command.add_option("--identity", options.identity,
                     "the identity, a folder in it; else operator, of play: player");
}

void runLoop(bus::WaitLoop& loop, double seconds) {
  const service::BlockedSignals blocked;
  const service::SignalThread signals(blocked, [&] { loop.stop(); });
  if (seconds > 0) {
    loop.every(std::chrono::nanoseconds(static_cast<std::int64_t>(seconds * 1e9)),
               [&] { loop.stop(); });
  }
  loop.run();
}

double steadySeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void refuseTopic(const std::string& topic) {
  throw StartupError(ExitCode::kUsage,
                     "there is no topic " + topic + "; the topics are " + knownTopics());
}

}  // namespace perdure::tools
