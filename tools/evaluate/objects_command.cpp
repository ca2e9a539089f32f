// `perdure evaluate objects`: prints the scores at nine pairs of thresholds and of the identities.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "common/replay/files/pose_file.h"
#include "tools/evaluate/command.h"
#include "tools/evaluate/object_score.h"
#include "tools/evaluate/simulated_truth.h"
#include "tools/evaluate/used_frames.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

struct ObjectsOptions {
  std::string truth, sequence, csv, trajectory, class_name;
  std::vector<std::uint32_t> image_size;
  ScoreOptions score;
  bool json = false, list = false;
};

struct Evaluated {
  ObjectScore score;
  std::uint64_t estimates = 0, poses = 0;
  std::string of;            ///< description of ground truth and class, for people
  std::size_t left_out = 0;  ///< frames with ground truth that the run skipped
  /// Frames without a pose between frames with one; 0 if the run states which frames it used.
  std::size_t untold = 0;
};

fs::path trajectoryOf(const ObjectsOptions& options) {
  const fs::path beside = fs::path(options.csv).parent_path() / "trajectory.tum";
  return options.trajectory.empty() ? beside : fs::path(options.trajectory);
}

std::vector<replay::StampedPose> posesOf(const ObjectsOptions& options) {
  return replay::PoseFile::read(trajectoryOf(options),
                                "--trajectory takes the trajectory.tum of the run")
      .poses();
}

replay::KittiCalibration readCalibration(const ObjectsOptions& options) {
  const fs::path root = options.truth;
  auto calibration = replay::readTrackingCalibration(root / "calib" / (options.sequence + ".txt"));
  const auto size = replay::trackingImageSize(options.sequence);
  calibration.width = options.image_size.empty() ? size.width : options.image_size[0];
  calibration.height = options.image_size.empty() ? size.height : options.image_size[1];
  return calibration;
}

Evaluated evaluateKitti(ObjectsOptions options) {
  const auto used = usedFramesOf(fs::path(options.csv).parent_path());
  if (used) options.score.frame_interval_s *= strideOf(*used);
  const std::string class_name = options.class_name.empty() ? "car" : options.class_name;
  const auto labels =
      replay::readKittiLabels(fs::path(options.truth) / "label_02" / (options.sequence + ".txt"));
  const auto calibration = readCalibration(options);
  auto rows = readObjectRows(options.csv);
  const auto poses = posesByFrame(posesOf(options), rows, used);
  std::erase_if(rows, [&](const EstimateRow& row) { return row.class_name != class_name; });
  auto truth = sortTruth(labels, staticTracks(labels, calibration.T_RI, poses));
  const std::size_t left_out = leaveOut(truth, used);
  const auto unposed = [&](const auto& frame) {
    return frame.first > poses.begin()->first && frame.first < poses.rbegin()->first &&
           !poses.contains(frame.first);
  };
  const bool told = used || poses.empty();
  const auto untold = told ? 0 : std::ranges::count_if(truth, unposed);
  return {scoreObjects(rows, truth, poses, calibration, options.score),
          rows.size(),
          poses.size(),
          "sequence " + options.sequence + ", class " + class_name,
          left_out,
          static_cast<std::size_t>(untold)};
}

Evaluated evaluateSimulated(ObjectsOptions options) {
  const SimulatedTruth truth = readSimulatedTruth(options.truth);
  const auto used = usedFramesOf(fs::path(options.csv).parent_path());
  const auto poses = posesOf(options);
  SimulatedRun run = pairWithTruth(truth, readObjectRows(options.csv), poses, options.class_name);
  const std::size_t left_out = leaveOut(run.frames, used);
  options.score.frame_interval_s = truth.frameInterval() * (used ? strideOf(*used) : 1.0);
  Evaluated result{
      scoreFrames(run.frames, options.score),
      run.estimates,
      run.poses,
      "simulated, " + (options.class_name.empty() ? "all classes" : "class " + options.class_name),
      left_out,
      used ? 0 : withoutPose(truth.frames, poses)};
  result.score.outside = run.outside;
  return result;
}

Evaluated evaluate(const ObjectsOptions& options) {
  if (!options.sequence.empty()) return evaluateKitti(options);
  return evaluateSimulated(options);
}

nlohmann::ordered_json toJson(const Evaluated& result) {
  const ObjectScore& s = result.score;
  nlohmann::ordered_json cells = nlohmann::ordered_json::array();
  for (std::size_t d = 0; d < 3; ++d) {
    for (std::size_t a = 0; a < 3; ++a) {
      const Cell& c = s.cells[d][a];
      cells.push_back({{"distance_m", kDistances_m[d]},
                       {"angle_deg", a == 2 ? nlohmann::ordered_json("any")
                                            : nlohmann::ordered_json(kAngles_deg[a])},
                       {"precision", c.precision()},
                       {"recall", c.recall()},
                       {"matched", c.matched},
                       {"truth", c.truth},
                       {"false_alarms", c.false_alarms}});
    }
  }
  const double objects = std::max<double>(1.0, static_cast<double>(s.objects));
  return {{"cells", cells},
          {"objects", s.objects},
          {"objects_found", s.objects_found},
          {"mean_object_recall", s.mean_object_recall},
          {"position_error_m", s.position_error_m},
          {"id_switches", s.id_switches},
          {"ids_per_found_object", s.idsPerFound()},
          {"ids_per_object", static_cast<double>(s.ids_matched) / objects},
          {"duplicates_per_object", static_cast<double>(s.duplicates) / objects},
          {"flicker_per_minute",
           s.minutes > 0 ? static_cast<double>(s.interruptions) / s.minutes : 0.0},
          {"estimates", result.estimates},
          {"neutral", s.neutral},
          {"outside_image", s.outside},
          {"frames_with_pose", result.poses},
          {"frames_left_out", result.left_out},
          {"frames_untold", result.untold}};
}

void printMishaps(const ObjectScore& score) {
  for (const Mishap& m : score.mishaps) {
    fmt::print(
        "frame {:4} {:<11} {:4} at {:6.1f} {:5.1f} {:6.1f} m in the camera, nearest {} {:.2f} m\n",
        m.frame, m.miss ? "miss" : "false alarm", m.id, m.centre.x(), m.centre.y(), m.centre.z(),
        m.miss ? "estimate" : "label", m.nearest_m);
  }
}

void print(const Evaluated& result, const ObjectsOptions& options) {
  const ObjectScore& s = result.score;
  const auto json = toJson(result);
  fmt::print("{}{}: precision / recall\n", result.of, options.score.strict ? ", strict" : "");
  fmt::print("          < 30 deg       < 45 deg       any\n");
  for (std::size_t d = 0; d < 3; ++d) {
    fmt::print("< {:.1f} m", kDistances_m[d]);
    for (const Cell& c : s.cells[d]) fmt::print("   {:.3f} / {:.3f}", c.precision(), c.recall());
    fmt::print("\n");
  }
  const Cell& wide = s.cells[2][2];
  fmt::print("at 1.5 m, any: {} matched of {}, {} false alarms, {} neutral\n", wide.matched,
             wide.truth, wide.false_alarms, s.neutral);
  fmt::print(
      "true objects: {} of {} found, mean recall over objects {:.3f}, position error {:.3f} m\n",
      s.objects_found, s.objects, s.mean_object_recall, s.position_error_m);
  fmt::print(
      "identities: {} switches, {:.2f} ids a found object, {:.2f} duplicates an object, "
      "{:.2f} interruptions a minute\n",
      s.id_switches, s.idsPerFound(), json["duplicates_per_object"].get<double>(),
      json["flicker_per_minute"].get<double>());
  if (result.left_out > 0) {
    fmt::print("{} frames do not count: the run was not over them (--every, --from, --seconds)\n",
               result.left_out);
  }
  if (result.untold > 0) fmt::print("{}\n", noteOfUntold(result.untold));
}

}  // namespace

void addEvaluateObjects(CLI::App& evaluate_app) {
  auto options = std::make_shared<ObjectsOptions>();
  CLI::App* app = evaluate_app.add_subcommand(
      "objects", "Precision and recall of objects_inst.csv or objects_final.csv");
  app->add_option("csv", options->csv, "objects_inst.csv or objects_final.csv")->required();
  app->add_option("--truth", options->truth,
                  "A simulated folder, or the root of KITTI tracking (label_02, calib)")
      ->required();
  app->add_option("--sequence", options->sequence, "Of KITTI tracking, for example 0000");
  app->add_option("--trajectory", options->trajectory, "Default: trajectory.tum beside the CSV");
  app->add_option("--class", options->class_name,
                  "Only this class; without it car on KITTI, all of them where simulated");
  app->add_option("--image-size", options->image_size, "Width and height in pixels")->expected(2);
  app->add_flag("--strict", options->score.strict, "Estimates on ignored labels are false alarms");
  app->add_flag("--list", options->list, "List every false alarm and miss (1.5 m, any angle)");
  app->add_flag("--json", options->json, "Print JSON");
  app->callback([options] {
    const Evaluated result = evaluate(*options);
    if (options->list && !options->json) printMishaps(result.score);
    if (options->json)
      std::cout << toJson(result).dump(2) << std::endl;
    else
      print(result, *options);
  });
}

}  // namespace perdure::tools
