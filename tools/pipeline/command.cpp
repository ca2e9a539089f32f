#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/base/errors.h"
#include "common/replay/recordings/ros_topics.h"
#include "tools/calibrate/motion/from_motion.h"
#include "tools/data_check/data_check.h"
#include "tools/outputs/results_folder.h"
#include "tools/perdure/commands.h"
#include "tools/pipeline/pipeline.h"
#include "tools/pipeline/report.h"

namespace perdure::tools {
namespace {

void addOptions(CLI::App& app, PipelineOptions& options) {
  app.add_option("--data", options.data,
                 "Dataset folder: EuRoC (simulated too), KITTI raw or tracking, 7-Scenes, or that "
                 "of a phone's logger; a film of a GoPro; or a recording: .mcap (of ROS too), .db3, .bag, or a "
                 "folder of them")
      ->required();
  app.add_option(
      "--rig", options.rig,
      "Rig file of perdure calibrate, instead of the drive's own calibration; auto: found "
      "from the motion of the first minute");
  app.add_option("--topic", options.topics,
                 "Of a recording of ROS where there are several: cam0=TOPIC, cam1=TOPIC, imu=TOPIC")
      ->take_all();
  app.add_option(
      "--sequence", options.sequence,
      "Of a KITTI tracking folder, for example 0000, or a 7-Scenes one, for example seq-01");
  app.add_option("--odometry", options.odometry,
                 "vio, truth, drifting (truth with a drift, --set drifting.KEY=VALUE), a pose file "
                 "(TUM or KITTI lines), or recorded")
      ->required();
  app.add_option("--odometry-of", options.odometry_of,
                 "Frame of a pose file: body, or camera (cam0, z forward; KITTI's ground truth is)")
      ->check(CLI::IsMember({"body", "camera"}));
  app.add_option("--odometry-walk", options.odometry_walk,
                 "Accuracy of a pose file: random walk POSITION,YAW over the distance, m/√m and "
                 "rad/√m; .03,.0005 if not given");
  app.add_flag("--landmarks", options.landmarks,
               "Where the poses are given: points from the images too, as vio has them");
  app.add_option("--detections", options.detections,
                 "model, none, simulated, a file (CSV, COCO's JSON, MOT's lines), or recorded")
      ->required();
  app.add_option("--model", options.model, "Network for --detections model (.onnx, .cfg)");
  app.add_option("--class", options.class_name, "Class of a file that names none, for example Car");
  app.add_option("--box-origin", options.box_origin,
                 "First pixel's coordinate in the CSV; RRC counts from 1")
      ->capture_default_str();
  auto* outline = app.add_flag("--outline-boxes", options.outline_boxes,
                               "The CSV's boxes enclose what is seen of a thing (COCO)");
  app.add_flag("--cuboid-boxes", options.cuboid_boxes,
               "They enclose the image of its cuboid (KITTI); without either it is estimated")
      ->excludes(outline);
  app.add_option("--image-size", options.image_size, "Width and height, KITTI tracking only")
      ->expected(2)
      ->check(CLI::Range(1, 65535));
  app.add_option("--out", options.out, "Folder for the results")->required();
  app.add_option("--map", options.map,
                 "Begin with a stored map: it is copied to OUT/map.sqlite and stays as it is");
  app.add_option("--from", options.from, "Begin so many seconds after the first frame")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--every", options.every, "Use each N-th frame only")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--seconds", options.seconds, "Stop after so many seconds of data")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--seed", options.seed, "Of --detections simulated and --odometry drifting")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--config", options.configs, "service=FILE in place of config/service.yaml")
      ->take_all();
  app.add_option(
         "--set", options.assignments,
         "service.key=value; services are vio, semantic_filter, inference, map_store, detector "
         "(the simulated one) and drifting (odometry)")
      ->take_all();
  app.add_flag("--pictures", options.pictures, "Also overlay.mp4: the frames with the objects");
  app.add_flag(
      "--record", options.record,
      "Also run.mcap: what the filter heard and said, for --odometry recorded, perdure play "
      "and other readers");
  app.add_flag("--quiet", options.quiet, "No progress");
}

/// Updates one line on a terminal; otherwise prints a line every 50 frames and every two seconds.
void showProgress(const Pipeline& pipeline, const PipelineCounts& counts) {
  using Clock = std::chrono::steady_clock;
  static Clock::time_point shown = Clock::now();
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const bool late = Clock::now() - shown > std::chrono::seconds(2);
  if (!terminal && !late && counts.frames % 50 != 0) return;
  shown = Clock::now();
  std::fprintf(stderr, "%sframe %llu of %zu, %llu poses, %llu detections, %zu objects%s",
               terminal ? "\r" : "", static_cast<unsigned long long>(counts.frames),
               pipeline.dataset().frameCount(), static_cast<unsigned long long>(counts.odometry),
               static_cast<unsigned long long>(counts.detections),
               pipeline.outputs().history().confirmedNow(), terminal ? "\033[K" : "\n");
}

void drawOverlay(const Pipeline& pipeline, bool quiet) {
  const bool terminal = !quiet && isatty(STDERR_FILENO) != 0;
  const std::string sentence = pipeline.drawOverlay([&](std::size_t done, std::size_t all) {
    if (terminal) std::fprintf(stderr, "\roverlay: frame %zu of %zu\033[K", done, all);
  });
  std::fprintf(stderr, "%s%s\n", terminal ? "\r\033[K" : "", sentence.c_str());
}

void printReasons(const Pipeline& pipeline) {
  for (const auto& [service, reasons] : pipeline.reasons()) {
    for (const auto& [code, count] : reasons.all()) {
      std::fprintf(stderr, "%s: %s %llu times\n", service.c_str(), code.c_str(),
                   static_cast<unsigned long long>(count));
    }
  }
  if (const auto doubt = pipeline.doubtOfPoses(); !doubt.empty()) {
    std::fprintf(stderr, "At the end: %s\n", doubt.c_str());
  }
  printWarnings(pipeline.doubts());
}

/// Runs the pipeline and writes its outputs to options.out. If the run has no results, returns the
/// error, which is to be reported when the outputs are stored.
std::optional<StartupError> runInto(const PipelineOptions& options, const std::string& named) {
  if (!options.quiet) std::fprintf(stderr, "checks %s\n", options.data.c_str());
  Pipeline pipeline(options);
  printDoubts(pipeline.dataset().recording(), pipeline.findings());
  pipeline.run([&](const PipelineCounts& counts) {
    if (!options.quiet) showProgress(pipeline, counts);
  });
  if (!options.quiet && isatty(STDERR_FILENO) != 0) std::fputc('\n', stderr);
  pipeline.finish();
  pipeline.outputs().writeJson("report.json", makeReport(pipeline, options));
  if (options.pictures) drawOverlay(pipeline, options.quiet);
  printReasons(pipeline);
  std::printf("%llu frames, %llu poses, %llu detections, %zu objects on the map: %s%s\n",
              static_cast<unsigned long long>(pipeline.counts().frames),
              static_cast<unsigned long long>(pipeline.counts().odometry),
              static_cast<unsigned long long>(pipeline.counts().detections),
              pipeline.outputs().history().lastBeliefs().size(), named.c_str(),
              endOfLine(pipeline.doubts()).c_str());
  try {
    pipeline.refuseNothing();
  } catch (const StartupError& nothing) {
    return nothing;
  }
  return std::nullopt;
}

/// Implements `--rig auto`: finds the rig and writes it to OUT/rig.yaml.
void findRig(PipelineOptions& options) {
  constexpr double kFirst_s = 60.0;
  const std::string file = options.out + "/rig.yaml";
  std::filesystem::create_directories(options.out);
  const replay::DatasetOptions drive{.path = options.data,
                                     .sequence = options.sequence,
                                     .topics = replay::topicsOf(options.topics)};
  const auto found = calibrate::writeMotionRig(drive, {.until_s = kFirst_s}, file);
  for (const auto& line : calibrate::linesOf(found)) {
    std::fprintf(stderr, "rig: %s\n", line.c_str());
  }
  options.rig = file;
}

void run(const PipelineOptions& given) {
  refuseOut(given);
  ResultsFolder results(given.out);
  PipelineOptions options = given;
  options.out = results.folder().string();
  if (options.rig == "auto") findRig(options);
  const auto nothing = runInto(options, given.out);
  results.keep();
  if (nothing) throw StartupError(*nothing);
}

}  // namespace

void setUpPipeline(CLI::App& pipeline) {
  auto options = std::make_shared<PipelineOptions>();
  addOptions(pipeline, *options);
  pipeline.callback([options] { run(*options); });
}

}  // namespace perdure::tools
