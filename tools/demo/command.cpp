#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>

#include "common/base/errors.h"
#include "common/service/signals.h"
#include "tools/demo/demo.h"
#include "tools/demo/embedded_drive.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

/// Shows the rendering progress: one updated line on a terminal, else one line for each tenth.
void showRendering(const SimulateProgress& progress) {
  const bool terminal = isatty(STDERR_FILENO) == 1;
  const std::size_t tenth = std::max<std::size_t>(1, progress.frames / 10);
  const bool last = progress.frame == progress.frames;
  if (!terminal && progress.frame % tenth != 0 && !last) return;
  std::cerr << fmt::format("{}demo: renders the drive, frame {} of {}{}",
                           terminal ? "\r\033[K" : "", progress.frame, progress.frames,
                           terminal && !last ? "" : "\n")
            << std::flush;
}

/// Folder for the rendered drives if Perdure is installed.
fs::path userCache() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  if (cache != nullptr && *cache != '\0') return fs::path(cache) / "perdure";
  return (home != nullptr ? fs::path(home) / ".cache" : fs::temp_directory_path()) / "perdure";
}

/// Sets the missing options: folders, the demo's rendered drive and its network.
void complete(DemoOptions& options, const std::atomic<bool>& interrupted) {
  if (options.programs.empty()) options.programs = programFolder().string();
  const fs::path installed = programFolder().parent_path() / "share" / "perdure";
  if (options.root.empty()) {
    options.root = fs::exists("config") || !fs::exists(installed) ? "." : installed.string();
  }
  if (!options.data.empty()) {
    if (!options.model.empty()) return;
    throw StartupError(
        ExitCode::kUsage,
        "give --model FILE.onnx, the network that looks at the images of --data; the "
        "one in models/ knows rendered drives only");
  }
  if (options.model.empty()) options.model = embeddedModel(options.root);
  fs::path cache = options.cache;
  if (cache.empty()) {
    cache = options.root == installed ? userCache() : fs::path(options.root) / "out";
  }
  options.data = embeddedDrive(cache, [&](const SimulateProgress& progress) {
                   showRendering(progress);
                   if (interrupted) throw CLI::RuntimeError(130);
                 }).string();
}

void summarise(const fs::path& out, const std::string& end_of_line) {
  const auto report = nlohmann::json::parse(std::ifstream(out / "report.json"));
  std::cout << fmt::format(
      "frames {}  odometry {}  detections {}  objects {}\n"
      "latency from capture to objects: median {} ms, p99 {} ms; without the network's own time "
      "{} and {}\n",
      report["frames"].get<int>(), report["messages"]["odometry"].get<int>(),
      report["messages"]["detections"].get<int>(), report["messages"]["objects"].get<int>(),
      report["latency_ms"]["median"].get<double>(), report["latency_ms"]["p99"].get<double>(),
      report["latency_beyond_network_ms"]["median"].get<double>(),
      report["latency_beyond_network_ms"]["p99"].get<double>());
  for (const auto& [name, s] : report["services"].items()) {
    std::cout << fmt::format("{:<16} in {:>5}  out {:>5}  dropped {:>4}  restarts {}\n", name,
                             s.value("frames_in", 0), s.value("frames_out", 0),
                             s.value("dropped", 0), s.value("restarts", 0));
  }
  if (report.contains("objects")) {
    std::cout << fmt::format(
        "objects: recall {:.3f}, precision {:.3f} under 1 m, {:.2f} on the map for each found\n",
        report["objects"]["recall"].get<double>(), report["objects"]["precision"].get<double>(),
        report["objects"]["duplicates"].get<double>());
  }
  std::cout << "outputs: " << out.string() << end_of_line << std::endl;
}

void runDemo(DemoOptions options) {
  const service::BlockedSignals blocked;
  std::atomic<bool> interrupted = false;
  const service::SignalThread signals(blocked, [&] { interrupted = true; });
  complete(options, interrupted);
  Demo demo(options, interrupted);
  demo.run();
  summarise(fs::absolute(options.out), demo.endOfLine());
  if (interrupted) throw CLI::RuntimeError(130);
  if (options.keep) demo.keep();
}

}  // namespace

void setUpDemo(CLI::App& demo) {
  auto options = std::make_shared<DemoOptions>();
  options->out = "out/demo";
  options->root.clear();
  demo.add_option("--data", options->data, "folder of the drive; default: one that is rendered")
      ->type_name("DIR");
  demo.add_option("--rig", options->rig, "rig file instead of the drive's own calibration");
  demo.add_option(
          "--topic", options->topics,
          "of a recording of ROS where there are several: cam0=TOPIC, cam1=TOPIC, imu=TOPIC")
      ->take_all();
  demo.add_option("--sequence", options->sequence, "of KITTI tracking, for example 0000");
  demo.add_option("--model", options->model, "the network; default: the one in models/")
      ->type_name("FILE.onnx");
  demo.add_option("--seconds", options->seconds, "of the drive; default: all of it")
      ->check(CLI::PositiveNumber);
  demo.add_option("--rate", options->rate,
                  "seconds of the drive in one second, or max: as fast as the services answer")
      ->capture_default_str();
  demo.add_option("--out", options->out, "folder for what comes out")->capture_default_str();
  demo.add_flag("--keep", options->keep,
                "leave everything running at the end of the drive, until Ctrl-C");
  demo.add_flag("--headless", options->headless, "open no window (this version has none to open)");
  demo.add_option("--shared-memory-mb", options->shared_memory_mb,
                  "images up to this size go through shared memory, where iox-roudi runs")
      ->check(CLI::Range(0, 256));
  demo.add_option("--truth", options->truth, "root of KITTI tracking with label_02 and calib");
  demo.add_option("--truth-sequence", options->truth_sequence, "in --truth, for example 0000");
  demo.add_option("--root", options->root,
                  "folder that has config/ and models/; default: this one, else the installation");
  demo.add_option("--cache", options->cache,
                  "folder where rendered drives are kept; default: ROOT/out, or ~/.cache/perdure "
                  "of an installation");
  demo.add_option("--programs", options->programs,
                  "folder of the services; default: that of this program");
  demo.callback([options] { runDemo(*options); });
}

}  // namespace perdure::tools
