#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "common/wire/json.h"
#include "tools/bus_tools/common.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

struct EchoOptions {
  bus::Options bus;
  std::string topic;
  std::uint64_t count = 0;
  double seconds = 0;
};

void reportCounts(const bus::RawReader& reader) {
  ReasonCounts counts;
  reader.report(counts);
  for (const auto& [reason, n] : counts.all()) std::cerr << reason << ": " << n << '\n';
}

template <class T>
void echo(const EchoOptions& options, const bus::Topic<T>& topic) {
  const bus::Domain domain(options.bus);
  const bus::Participant participant(domain, "perdure echo");
  bus::WaitLoop loop(participant);
  bus::Reader<T> reader(participant, topic);
  std::uint64_t printed = 0;
  const auto print = [&](const nlohmann::ordered_json& json) {
    if (options.count > 0 && printed == options.count) return;
    std::cout << json.dump() << std::endl;
    if (++printed == options.count || !std::cout) loop.stop();
  };
  loop.on(
      reader, [&](const T& message) { print(wire::toJson(message)); },
      [&](const T& key) {
        print({{"disposed", wire::toJson(key)}});
      });
  runLoop(loop, options.seconds);
  reportCounts(reader);
}

void runEcho(const EchoOptions& options) {
  const auto visit = [&](const auto& topic) { echo(options, topic); };
  if (!bus::withTopic(options.topic, visit)) refuseTopic(options.topic);
}

}  // namespace

void setUpEcho(CLI::App& command) {
  auto options = std::make_shared<EchoOptions>();
  command.add_option("topic", options->topic, "its name, as odometry or frame/cam0")->required();
  command.add_option("--count", options->count, "end after so many messages");
  command.add_option("--seconds", options->seconds, "end after this time");
  addBusOptions(command, options->bus);
  command.callback([options] { runEcho(*options); });
}

}  // namespace perdure::tools
