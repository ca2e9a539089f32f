#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "common/service/signals.h"
#include "tools/bus_tools/common.h"
#include "tools/record/command.h"
#include "tools/record/files.h"
#include "tools/record/player.h"

namespace perdure::tools {
namespace {

struct Options {
  bus::Options bus;
  std::string path;
  PlayOptions play;
};

void runPlay(const Options& options) {
  const service::BlockedSignals blocked;
  replay::RecordedMessages recording(options.path);
  const bus::Domain domain(options.bus);
  const bus::Participant participant(domain, "perdure play");
  bus::WaitLoop loop(participant);
  const service::SignalThread signals(blocked, [&] { loop.stop(); });
  Player player(participant, loop, recording, options.play);
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

void addPlayCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("play", "play a recording onto the bus");
  auto options = std::make_shared<Options>();
  PlayOptions& play = options->play;
  command->add_option("path", options->path, "a .mcap file, or a folder of them")->required();
  command->add_option("--topics", play.topics, "only these, as odometry or frame/cam0");
  command
      ->add_option("--for", play.for_service,
                   "what one service listens to: vio, inference, semantic_filter or map_store")
      ->excludes("--topics");
  command->add_option("--rate", play.rate, "seconds of the recording in one second")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 100.0));
  command->add_option("--start", play.start_s, "seconds from its beginning")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--seconds", play.seconds, "how much of it")->check(CLI::NonNegativeNumber);
  command->add_option("--wait", play.wait_s, "seconds to wait for readers of each topic, at most")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--loop", play.loop, "again and again, with the same stamps");
  command->add_flag("--force", play.force, "also onto topics that others write now");
  addBusOptions(*command, options->bus);
  command->callback([options] { runPlay(*options); });
}

}  // namespace perdure::tools
