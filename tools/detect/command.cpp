#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/detect/detect.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

void run(const DetectOptions& options, bool quiet) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const auto summary = detect(options, [&](std::uint64_t done, std::uint64_t all) {
    if (quiet || (!terminal && done % 100 != 0)) return;
    std::fprintf(stderr, "%sframe %llu of %llu%s", terminal ? "\r" : "",
                 static_cast<unsigned long long>(done), static_cast<unsigned long long>(all),
                 terminal ? "\033[K" : "\n");
  });
  if (!quiet && terminal) std::fputc('\n', stderr);
  std::printf("%llu frames, %llu boxes, %llu frames failed, %.1f ms of CPU a frame (median): %s\n",
              static_cast<unsigned long long>(summary.frames),
              static_cast<unsigned long long>(summary.boxes),
              static_cast<unsigned long long>(summary.failed), summary.cpu_ms_median,
              options.out.c_str());
}

}  // namespace

void setUpDetect(CLI::App& detect) {
  auto options = std::make_shared<DetectOptions>();
  auto quiet = std::make_shared<bool>(false);
  detect.add_option("--data", options->data, "Dataset folder")->required();
  detect.add_option(
      "--sequence", options->sequence,
      "Of a KITTI tracking folder, for example 0000, or a 7-Scenes one, for example seq-01");
  detect.add_option("--model", options->inference.model.path, "Network (.onnx, .cfg)")->required();
  detect.add_option("--out", options->out, "The CSV")->required();
  detect
      .add_option("--threshold", options->inference.detection.score_threshold,
                  "Boxes whose best class scores less are left out")
      ->check(CLI::Range(0.001, 0.999))
      ->capture_default_str();
  detect
      .add_option("--turn", options->inference.detection.turn,
                  "Clockwise turn that makes the images upright for the network, degrees")
      ->check(CLI::IsMember({"0", "90", "180", "270"}));
  detect.add_option("--threads", options->inference.model.threads, "Of OpenCV")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  detect.add_flag("--quiet", *quiet, "No progress");
  detect.callback([options, quiet] { run(*options, *quiet); });
}

}  // namespace perdure::tools
