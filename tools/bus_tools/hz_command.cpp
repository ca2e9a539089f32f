#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/bus_tools/common.h"
#include "tools/bus_tools/rate_meter.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

struct HzOptions {
  bus::Options bus;
  std::string topic;
  double seconds = 0;
};

void print(const std::string& topic, const RateSummary& s, std::size_t writers) {
  if (s.messages < 2) {
    std::printf("%s: %zu messages, %zu writers\n", topic.c_str(), s.messages, writers);
  } else {
    std::printf("%s: %.2f Hz, interval %.1f … %.1f ms (deviation %.1f), %zu messages\n",
                topic.c_str(), s.rate_hz, 1e3 * s.shortest_s, 1e3 * s.longest_s,
                1e3 * s.deviation_s, s.messages);
  }
  std::fflush(stdout);
}

template <class T>
void measure(const HzOptions& options, const bus::Topic<T>& topic) {
  const bus::Domain domain(options.bus);
  const bus::Participant participant(domain, "perdure hz");
  bus::WaitLoop loop(participant);
  bus::Reader<T> reader(participant, topic, bus::ReadFrom::kNew);
  RateMeter meter;
  loop.on(reader, [&](const T&) { meter.arrived(steadySeconds()); });
  loop.every(std::chrono::seconds(1),
             [&] { print(topic.name, meter.summary(steadySeconds()), reader.matched()); });
  runLoop(loop, options.seconds);
}

void runHz(const HzOptions& options) {
  const auto visit = [&](const auto& topic) { measure(options, topic); };
  if (!bus::withTopic(options.topic, visit)) refuseTopic(options.topic);
}

}  // namespace

void setUpHz(CLI::App& command) {
  auto options = std::make_shared<HzOptions>();
  command.add_option("topic", options->topic, "its name, as odometry or frame/cam0")->required();
  command.add_option("--seconds", options->seconds, "end after this time");
  addBusOptions(command, options->bus);
  command.callback([options] { runHz(*options); });
}

}  // namespace perdure::tools
