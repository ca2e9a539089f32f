#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <chrono>
#include <iostream>
#include <memory>

#include "common/base/errors.h"
#include "tools/perdure/commands.h"
#include "tools/simulate/simulate.h"

namespace perdure::tools {
namespace {

struct CommandLine {
  SimulateOptions options;
  std::string size = "640x480", encoding = "png";
  double seconds = 0.0;
  bool list = false, quiet = false, no_noise = false, no_images = false;
};

void readSize(const std::string& text, sim::SceneOptions& world) {
  const char* end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, world.width);
  const bool has_x = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
  const auto height = has_x ? std::from_chars(width.ptr + 1, end, world.height) : width;
  const auto fits = [](std::uint32_t n) { return n >= 16 && n <= 4096; };
  if (!has_x || height.ec != std::errc() || height.ptr != end || !fits(world.width) ||
      !fits(world.height)) {
    throw StartupError(ExitCode::kUsage,
                       "--size is `{}`; give width and height, 16 to 4096, such as 640x480", text);
  }
}

void listScenes() {
  for (const auto& scene : sim::sceneNames()) {
    std::cout << fmt::format("{:<10} {}\n", scene.name, scene.proves);
  }
}

class ProgressBar {
 public:
  void show(const SimulateProgress& progress) {
    const auto elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
    const double rate =
        static_cast<double>(progress.frame - progress.resumed) / std::max(elapsed, 1e-3);
    const double left =
        static_cast<double>(progress.frames - progress.frame) / std::max(rate, 1e-3);
    const std::size_t tenth = progress.frame * 10 / progress.frames;
    if (!terminal_ && tenth == shown_) return;
    shown_ = tenth;
    std::string bar;
    if (terminal_) {
      const std::size_t full = progress.frame * 30 / progress.frames;
      bar = "\r[" + std::string(full, '#') + std::string(30 - full, '.') + "] ";
    }
    std::cerr << fmt::format("{}frame {} of {}, {:.1f} a second, {:.0f} s left{}", bar,
                             progress.frame, progress.frames, rate, left,
                             terminal_ ? "\033[K" : "\n")
              << std::flush;
    if (terminal_ && progress.frame == progress.frames) std::cerr << '\n';
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
  bool terminal_ = isatty(STDERR_FILENO) != 0;
  std::size_t shown_ = 0;
};

void run(CommandLine line) {
  if (line.list) return listScenes();
  SimulateOptions& options = line.options;
  if (options.scene.empty() || options.out.empty()) {
    throw StartupError(ExitCode::kUsage,
                       "give --scene NAME and --out DIR; perdure simulate --list shows the scenes");
  }
  readSize(line.size, options.world);
  if (line.seconds > 0.0) options.world.seconds = line.seconds;
  options.format = line.encoding == "png" ? ImageFormat::kPng : ImageFormat::kJpeg;
  options.world.noise = !line.no_noise;
  options.images = !line.no_images;
  ProgressBar bar;
  const bool made = simulate(options, [&](const SimulateProgress& progress) {
    if (!line.quiet) bar.show(progress);
  });
  std::cout << fmt::format("{}: {} {}, seed {}\n", options.out.string(),
                           made ? "simulated" : "already holds", options.scene, options.seed);
}

void addOptions(CLI::App& app, CommandLine& line) {
  SimulateOptions& options = line.options;
  app.add_flag("--list", line.list, "The scenes and what each proves");
  app.add_option("--scene", options.scene, "Name of the scene; see --list");
  app.add_option("--seed", options.seed, "The same seed gives the same bytes")
      ->capture_default_str();
  app.add_option("--seconds", line.seconds, "How long; the scene's own length where not given")
      ->check(CLI::PositiveNumber);
  app.add_option("--out", options.out, "Folder for the sequence");
  app.add_option("--size", line.size, "Width and height of the images")->capture_default_str();
  app.add_option("--rate", options.world.rate_hz, "Frames a second")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  app.add_option("--every", options.every, "Draw each N-th frame only")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--encoding", line.encoding, "png, or jpeg (quality 95)")
      ->check(CLI::IsMember({"png", "jpeg"}))
      ->capture_default_str();
  app.add_option("--look-set", options.world.look_set,
                 "Which colours, textures and details: use, train or test")
      ->check(CLI::IsMember({"use", "train", "test"}))
      ->capture_default_str();
  app.add_option("--threads", options.threads, "The result does not depend on it")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app.add_flag("--stereo", options.world.stereo, "A second camera");
  app.add_flag("--mono", options.world.mono8, "Grey images");
  app.add_flag("--rolling-shutter", options.world.rolling_shutter, "Rows are exposed in turn");
  app.add_flag("--no-noise", line.no_noise, "Sensors without noise, bias or a wandering gain");
  app.add_flag("--no-images", line.no_images,
               "Everything but the images; visibility at half the resolution");
  app.add_flag("--quiet", line.quiet, "No progress");
}

}  // namespace

void setUpSimulate(CLI::App& simulate) {
  auto line = std::make_shared<CommandLine>();
  addOptions(simulate, *line);
  simulate.callback([line] { run(*line); });
}

}  // namespace perdure::tools
