#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "common/service/signals.h"
#include "tools/bus_tools/common.h"
#include "tools/perdure/commands.h"
#include "tools/record/files.h"
#include "tools/record/gateway_replay.h"
#include "tools/record/player.h"

namespace perdure::tools {
namespace {

struct Options {
  bus::Options bus;
  std::string path;
  PlayOptions play;
  bool gateway = false, paused = false;
  std::int64_t port = 8765;
};

/// Serves the recording to browsers and Foxglove without a bus; the clients control the replay.
void runGateway(const Options& options) {
  const service::BlockedSignals blocked;
  replay::RecordedMessages recording(options.path);
  gateway::Config config;
  config.web.port = options.port;
  config.cameras.clear();
  for (const auto& [topic, counted] : recording.topics()) {
    if (topic.starts_with("frame/")) config.cameras.push_back(topic.substr(6));
  }
  gateway::PlaybackRequest start;
  start.play = !options.paused;
  start.speed = options.play.rate;
  GatewayReplay replay(recording, config, start, options.play.start_s);
  const service::SignalThread signals(blocked, [&] { replay.stop(); });
  const auto range = replay.range();
  fmt::print("{:.1f} s of {} at http://127.0.0.1:{}/\n", toSeconds(range.last - range.first),
             options.path, replay.port());
  std::fflush(stdout);
  replay.run();
}

void runPlay(const Options& options) {
  const service::BlockedSignals blocked;
  replay::RecordedMessages recording(options.path);
  const bus::Domain domain(options.bus);
  const bus::Participant participant(domain, "perdure play");
  bus::WaitLoop loop(participant);
  const service::SignalThread signals(blocked, [&] { loop.stop(); });
  Player player(participant, loop, recording, options.play);
  for (const std::string& what : player.leftOut()) {
    fmt::print("left out, for it is written by who listens: {}\n", what);
  }
  std::fflush(stdout);
  do {
    player.play();
  } while (options.play.loop && !loop.stopped());
  fmt::print("{} messages of {} topics were played\n", player.played(), player.topics().size());
  for (const auto* reasons : {&player.reasons(), &recording.reasons()}) {
    for (const auto& [reason, n] : reasons->all()) fmt::print("{}: {}\n", reason, n);
  }
  if (player.played() == 0 && !loop.stopped()) refuseNothing(recording, options.path);
}

}  // namespace

void setUpPlay(CLI::App& command) {
  auto options = std::make_shared<Options>();
  PlayOptions& play = options->play;
  command.add_option("path", options->path, "a .mcap file, or a folder of them")->required();
  command.add_option("--topics", play.topics, "only these, as odometry or frame/cam0");
  command
      .add_option("--for", play.for_service,
                  "what one service listens to: vio, inference, semantic_filter or map_store")
      ->excludes("--topics");
  command.add_option("--rate", play.rate, "seconds of the recording in one second")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 100.0));
  command.add_option("--start", play.start_s, "seconds from its beginning")
      ->check(CLI::NonNegativeNumber);
  command.add_option("--seconds", play.seconds, "how much of it")->check(CLI::NonNegativeNumber);
  command.add_option("--wait", play.wait_s, "seconds to wait for readers of each topic, at most")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command.add_flag("--loop", play.loop, "again and again, with the same stamps");
  command.add_flag("--force", play.force, "also onto topics that others write now");
  addBusOptions(command, options->bus);
  CLI::Option* gateway =
      command.add_flag("--gateway", options->gateway,
                       "to a browser or Foxglove instead of the bus; they play, pause and seek");
  for (const char* of_the_bus : {"--topics", "--for", "--seconds", "--wait", "--loop", "--force"}) {
    gateway->excludes(command.get_option(of_the_bus));
  }
  command.add_flag("--paused", options->paused, "with --gateway: begin with a pause")
      ->needs("--gateway");
  command.add_option("--port", options->port, "with --gateway; 0: any that is free")
      ->capture_default_str()
      ->check(CLI::Range(0, 65535));
  command.callback([options] { options->gateway ? runGateway(*options) : runPlay(*options); });
}

}  // namespace perdure::tools
