#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>

#include "tools/bus_tools/common.h"
#include "tools/bus_tools/status/status_watch.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

constexpr const char* kStatusHelp = R"(
Expected rates are those of the topic table for the camera and the IMU of `calibration`; images are
not read, their rate is what capture says. A bridge or a driver that writes what capture, vio or
inference would stands in for it. Exit status: 0 ok, 1 degraded, 2 failed or nobody there.)";

struct StatusOptions {
  bus::Options bus;
  double seconds = 2.5;
  std::vector<std::string> folders;
  bool watch = false, json = false;
};

StatusNode look(StatusWatch& watch, const StatusOptions& options) {
  StatusSeen seen = watch.seen();
  seen.host = lookAtHost(options.folders, options.bus);
  return judge(seen);
}

void print(const StatusNode& node, const StatusOptions& options) {
  const bool terminal = isatty(STDOUT_FILENO) == 1;
  if (options.json) {
    std::cout << dumped(toJson(node), options.watch ? -1 : 2) << std::endl;
    return;
  }
  if (options.watch && terminal) std::cout << "\033[H\033[2J";
  std::cout << toText(node, terminal) << std::flush;
}

void runStatus(StatusOptions options) {
  if (options.folders.empty() && std::filesystem::is_directory("/var/lib/perdure")) {
    options.folders = {"/var/lib/perdure"};
  }
  StatusWatch watch(options.bus);
  if (options.watch) {
    const auto start = std::chrono::steady_clock::now();
    watch.loop().every(std::chrono::milliseconds(500), [&] {
      constexpr std::chrono::seconds kFirst{2};  // time to observe all services
      if (std::chrono::steady_clock::now() - start < kFirst) return;
      print(look(watch, options), options);
      if (!std::cout) watch.loop().stop();
    });
    runLoop(watch.loop(), 0);
  } else {
    runLoop(watch.loop(), options.seconds);
  }
  const StatusNode node = look(watch, options);
  if (!options.watch) print(node, options);
  if (node.level != Level::kOk) throw CLI::RuntimeError(static_cast<int>(node.level));
}

}  // namespace

void setUpStatus(CLI::App& command) {
  auto options = std::make_shared<StatusOptions>();
  command.footer(kStatusHelp);
  command.add_option("--seconds", options->seconds, "how long to listen before it is judged")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  command.add_flag("--watch", options->watch, "twice a second, until Ctrl-C");
  command.add_flag("--json", options->json, "for programs; with --watch one line each time");
  command.add_option("--data-dir", options->folders,
                     "folder whose disk must have room; default: /var/lib/perdure where it exists");
  addBusOptions(command, options->bus);
  command.callback([options] { runStatus(*options); });
}

}  // namespace perdure::tools
