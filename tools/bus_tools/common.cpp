#include "tools/bus_tools/common.h"

#include <CLI/CLI.hpp>
#include <filesystem>

#include "common/base/errors.h"
#include "common/service/signals.h"

namespace perdure::tools {

std::string configurationFolder() {
  for (const char* folder : {"/etc/perdure", "config"}) {
    std::error_code ignored;
    if (std::filesystem::exists(std::filesystem::path(folder) / "capture.yaml", ignored))
      return folder;
  }
  return {};
}

void addBusOptions(CLI::App& command, bus::Options& options) {
  // Before the command line: options of it go before the file.
  command.preparse_callback([&options](std::size_t) {
    std::vector<config::Problem> problems;
    const bus::Options common = bus::commonOptions(configurationFolder(), problems);
    config::refuse(problems);
    options = common;
    options.shared_memory_mb = 0;  // what listens needs none
    options.identity.clear();      // that of the services
  });
  command.add_option("--interface", options.interface, "network interface of the topics")
      ->capture_default_str();
  command.add_option("--peers", options.peers, "addresses of other hosts, without multicast");
  command.add_option("--domain", options.domain, "DDS domain (PERDURE_DOMAIN goes before it)")
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

std::string knownTopics() {
  std::string names;
  for (const bus::TopicInfo& info : bus::topicTable()) {
    names += (names.empty() ? "" : ", ") + std::string(info.name);
    if (info.name.ends_with('/')) names += "<camera>";
  }
  return names;
}

void refuseTopic(const std::string& topic) {
  throw StartupError(ExitCode::kUsage,
                     "there is no topic " + topic + "; the topics are " + knownTopics());
}

}  // namespace perdure::tools
