#include "tools/demo/command.h"

#include <fmt/format.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>

#include "common/base/errors.h"
#include "common/service/signals.h"
#include "tools/demo/demo.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

void require(const DemoOptions& options) {
  if (options.data.empty()) {
    throw StartupError(ExitCode::kUsage,
                       "there is no simulated drive yet: give --data DIR, a drive in EuRoC, KITTI "
                       "raw or KITTI tracking layout, and --model FILE.onnx");
  }
  if (options.model.empty()) {
    throw StartupError(ExitCode::kUsage, "give --model FILE.onnx, the network that looks at images");
  }
}

void summarise(const fs::path& out) {
  const auto report = nlohmann::json::parse(std::ifstream(out / "report.json"));
  std::cout << fmt::format(
      "frames {}  odometry {}  detections {}  objects {}\n"
      "latency from capture to objects: median {} ms, p99 {} ms\n",
      report["frames"].get<int>(), report["messages"]["odometry"].get<int>(),
      report["messages"]["detections"].get<int>(), report["messages"]["objects"].get<int>(),
      report["latency_ms"]["median"].get<double>(), report["latency_ms"]["p99"].get<double>());
  for (const auto& [name, s] : report["services"].items()) {
    std::cout << fmt::format("{:<16} in {:>5}  out {:>5}  dropped {:>4}  restarts {}\n", name,
                             s.value("frames_in", 0), s.value("frames_out", 0),
                             s.value("dropped", 0), s.value("restarts", 0));
  }
  if (report.contains("objects")) {
    std::cout << fmt::format("cars: recall {:.3f}, precision {:.3f} under 1 m\n",
                             report["objects"]["recall"].get<double>(),
                             report["objects"]["precision"].get<double>());
  }
  std::cout << "outputs: " << out.string() << std::endl;
}

void runDemo(DemoOptions options) {
  require(options);
  if (options.programs.empty()) {
    options.programs = fs::read_symlink("/proc/self/exe").parent_path().string();
  }
  const service::BlockedSignals blocked;
  std::atomic<bool> interrupted = false;
  const service::SignalThread signals(blocked, [&] { interrupted = true; });
  Demo(options, interrupted).run();
  summarise(fs::absolute(options.out));
  if (interrupted) throw CLI::RuntimeError(130);
}

}  // namespace

void addDemoCommand(CLI::App& app) {
  auto options = std::make_shared<DemoOptions>();
  options->out = "out/demo";
  CLI::App* demo = app.add_subcommand(
      "demo", "The five services under supervision over a drive; deploy/demo builds and calls it");
  demo->add_option("--data", options->data, "folder of the drive")->type_name("DIR");
  demo->add_option("--sequence", options->sequence, "of KITTI tracking, for example 0000");
  demo->add_option("--model", options->model, "the network")->type_name("FILE.onnx");
  demo->add_option("--seconds", options->seconds, "of the drive; default: all of it")
      ->check(CLI::PositiveNumber);
  demo->add_option("--rate", options->rate,
                   "seconds of the drive in one second, or max: as fast as the services answer")
      ->capture_default_str();
  demo->add_option("--out", options->out, "folder for what comes out")->capture_default_str();
  demo->add_flag("--headless", options->headless,
                 "open no window (this version has none to open)");
  demo->add_option("--truth", options->truth, "root of KITTI tracking with label_02 and calib");
  demo->add_option("--truth-sequence", options->truth_sequence, "in --truth, for example 0000");
  demo->add_option("--root", options->root, "folder that has config/")->capture_default_str();
  demo->add_option("--programs", options->programs,
                   "folder of the services; default: that of this program");
  demo->callback([options] { runDemo(*options); });
}

}  // namespace perdure::tools
