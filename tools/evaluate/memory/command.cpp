// `perdure evaluate memory`: checks whether objects that are seen again keep their ids.
#include "tools/evaluate/command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/base/errors.h"
#include "common/replay/files/text_file.h"
#include "services/map_store/core/map_database.h"
#include "tools/evaluate/memory/loops.h"
#include "tools/evaluate/memory/visits.h"
#include "tools/evaluate/trajectory_score.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct MemoryCommand {
  std::string run, truth, map_run;
  bool json = false;
};

struct TrajectoryErrors {
  TrajectoryScore from_start, aligned;
};

struct MemoryResult {
  MemoryScore memory;
  TrajectoryErrors trajectory;
  std::optional<TrajectoryErrors> map_trajectory;
  std::optional<ReturnScore> returned;
  std::optional<LoopScore> loops;  ///< set if the run stored a graph
};

std::vector<MemoryFrame> framesOf(const fs::path& run, const SimulatedTruth& truth,
                                  const MemoryOptions& options) {
  for (const char* file : {"objects_inst.csv", "trajectory.tum"}) {
    if (fs::exists(run / file)) continue;
    replay::throwMissing(run / file, "a part of the run",
                         "name a folder that `perdure pipeline --out` made");
  }
  auto frames = besideTheBody(truth, readObjectRows(run / "objects_inst.csv"),
                              replay::PoseFile::read(run / "trajectory.tum").poses(), options);
  if (frames.size() < 2) {
    throw StartupError(ExitCode::kUnavailable,
                       (run / "trajectory.tum").string() +
                           " has fewer than two times in common with the truth; name the "
                           "simulated folder over which the run went");
  }
  return frames;
}

TrajectoryErrors trajectoryErrors(const fs::path& file, const SimulatedTruth& truth) {
  std::vector<PosePair> pairs;
  const auto poses = replay::PoseFile::read(file).poses();
  for (const auto& pose : poses) {
    if (const auto there = truth.body.at(0, pose.time))
      pairs.push_back({pose.time, pose.T_WB, *there});
  }
  if (pairs.size() < 2) {
    throw StartupError(ExitCode::kUnavailable,
                       file.string() + " has fewer than two times in common with the truth");
  }
  return {scoreTrajectory(pairs, Alignment::kStart), scoreTrajectory(pairs, Alignment::kYaw)};
}

/// The map's graph; empty if the run stored none.
std::optional<mapping::SavedMap> graphOf(const fs::path& run) {
  const fs::path file = run / "map.sqlite";
  if (!fs::exists(file)) return std::nullopt;
  const auto connection = map_store::openStoreForReading(file);
  auto graph = map_store::MapReader(&connection).graph();
  if (!graph) {
    throw StartupError(ExitCode::kUnavailable,
                       file.string() + " cannot be read: " + graph.error().detail +
                           "; name a folder whose pipeline run came to its end");
  }
  if (graph->map.anchors.empty()) return std::nullopt;
  return std::move(graph->map);
}

MemoryResult evaluateMemory(const MemoryCommand& command) {
  const MemoryOptions options;
  const SimulatedTruth truth = readSimulatedTruth(command.truth);
  const fs::path run = command.run;
  const auto frames = framesOf(run, truth, options);
  MemoryResult result;
  result.memory = scoreMemory(truth, frames, options);
  result.trajectory = trajectoryErrors(run / "trajectory.tum", truth);
  if (const auto map = run / "trajectory_map.tum"; fs::exists(map))
    result.map_trajectory = trajectoryErrors(map, truth);
  if (const auto map = graphOf(run))
    result.loops = scoreLoops(*map, truth.body, frames, options, LoopOptions{});
  if (!command.map_run.empty())
    result.returned = scoreReturn(framesOf(command.map_run, truth, options), frames, options);
  return result;
}

Json toJson(const TrajectoryErrors& errors) {
  return {{"length_m", errors.aligned.length_m},
          {"ate_from_start_m", errors.from_start.ate_rmse_m},
          {"ate_from_start_max_m", errors.from_start.ate_max_m},
          {"ate_aligned_m", errors.aligned.ate_rmse_m},
          {"ate_aligned_max_m", errors.aligned.ate_max_m}};
}

Json toJson(const ReturnScore& score) {
  Json json = {{"ids", score.ids},       {"known_objects", score.known},
               {"seen", score.seen},     {"reported", score.reported},
               {"kept", score.kept},     {"kept_share", score.keptShare()},
               {"wrong", score.wrong},   {"first_s", nullptr},
               {"first_way_m", nullptr}, {"first_objects", nullptr}};
  if (score.first) {
    json["first_s"] = score.first->seconds;
    json["first_way_m"] = score.first->way_m;
    json["first_objects"] = score.first->objects;
  }
  return json;
}

Json toJson(const JudgedLoop& loop) {
  return {{"edge", loop.id},
          {"from_ns", toNanoseconds(loop.from)},
          {"to_ns", toNanoseconds(loop.to)},
          {"off_m", loop.off_m},
          {"off_deg", loop.off_rad * 180.0 / std::numbers::pi},
          {"sigma_m", loop.sigma_m},
          {"weight", loop.weight}};
}

Json toJson(const LoopScore& score) {
  const LoopJudgement& judgement = score.judgement;
  Json json = {{"all", judgement.loops.size()},     {"believed", judgement.believed()},
               {"wrong", judgement.wrong()},        {"wrong_believed", judgement.wrongBelieved()},
               {"unjudged", judgement.unjudged},    {"returns", score.returns.size()},
               {"returns_without", score.missed()}, {"way_to_close_m", nullptr},
               {"anchors", score.anchors.anchors},  {"ate_odometry_m", score.anchors.odometry_m},
               {"ate_map_m", score.anchors.map_m},  {"wrong_loops", Json::array()}};
  if (const auto way = score.wayToClose()) json["way_to_close_m"] = *way;
  for (const JudgedLoop& loop : judgement.loops) {
    if (loop.wrong) json["wrong_loops"].push_back(toJson(loop));
  }
  return json;
}

Json toJson(const MemoryResult& result) {
  const MemoryScore& s = result.memory;
  Json json = {{"frames", s.frames},
               {"objects", s.objects},
               {"seen_twice", s.seen_twice},
               {"reported_twice", s.reported_twice},
               {"ids_kept", s.kept},
               {"ids_kept_share", s.keptShare()},
               {"drift_between_visits_m", s.drift_m},
               {"sightings", s.sightings},
               {"recall", s.recall()},
               {"recall_second_half", s.lateRecall()},
               {"objects_reported", s.objects_matched},
               {"ids_per_object", s.idsPerObject()},
               {"objects_with_more_ids", s.with_more_ids},
               {"trajectory", toJson(result.trajectory)}};
  if (result.map_trajectory) json["trajectory_map"] = toJson(*result.map_trajectory);
  if (result.loops) json["loops"] = toJson(*result.loops);
  if (result.returned) json["map_run"] = toJson(*result.returned);
  return json;
}

void print(const char* name, const TrajectoryErrors& errors) {
  fmt::print(
      "{}: ATE {:.3f} m from the start, {:.3f} m aligned in position and yaw, over {:.0f} m\n",
      name, errors.from_start.ate_rmse_m, errors.aligned.ate_rmse_m, errors.aligned.length_m);
}

void print(const ReturnScore& s) {
  fmt::print("map of the run before: {} ids; {} of its objects are seen here\n", s.ids, s.known);
  if (!s.first) {
    fmt::print("no id of it appears\n");
    return;
  }
  fmt::print("first id of it after {:.1f} s, {:.1f} m and {} objects in view\n", s.first->seconds,
             s.first->way_m, s.first->objects);
  fmt::print(
      "from then on: {} seen, {} reported, {} with their id ({:.3f} of all), {} with "
      "another object's\n",
      s.seen, s.reported, s.kept, s.keptShare(), s.wrong);
}

void print(const LoopScore& score) {
  const LoopJudgement& judgement = score.judgement;
  fmt::print("loops: {}, of these wrong {}; believed: {}, of these wrong {}\n",
             judgement.loops.size(), judgement.wrong(), judgement.believed(),
             judgement.wrongBelieved());
  if (judgement.unjudged > 0) fmt::print("loops without a true pose: {}\n", judgement.unjudged);
  for (const JudgedLoop& loop : judgement.loops) {
    if (!loop.wrong) continue;
    fmt::print(
        "wrong: edge {}, off by {:.2f} m (deviation {:.2f} m) and {:.1f}°, weight {:.2f}{}\n",
        loop.id, loop.off_m, loop.sigma_m, loop.off_rad * 180.0 / std::numbers::pi, loop.weight,
        loop.believed ? "" : ", not believed");
  }
  const auto way = score.wayToClose();
  fmt::print("returns: {}, without a loop {}{}\n", score.returns.size(), score.missed(),
             way ? fmt::format("; a loop after {:.1f} m (median)", *way) : "");
  fmt::print("{} anchors: ATE {:.3f} m by odometry, {:.3f} m in the map\n", score.anchors.anchors,
             score.anchors.odometry_m, score.anchors.map_m);
}

void print(const MemoryResult& result) {
  const MemoryScore& s = result.memory;
  fmt::print("{} frames, {} objects; {} seen twice, {} reported twice\n", s.frames, s.objects,
             s.seen_twice, s.reported_twice);
  fmt::print("ids kept: {:.3f} of {}; the frame drifted by {:.2f} m between visits (median)\n",
             s.keptShare(), s.reported_twice, s.drift_m);
  fmt::print("recall within 25 m: {:.3f} of {}; in the second half {:.3f}\n", s.recall(),
             s.sightings, s.lateRecall());
  fmt::print("ids per reported object: {:.3f}; {} of {} have more than one\n", s.idsPerObject(),
             s.with_more_ids, s.objects_matched);
  print("trajectory", result.trajectory);
  if (result.map_trajectory) print("trajectory in the map", *result.map_trajectory);
  if (result.loops) print(*result.loops);
  if (result.returned) print(*result.returned);
}

}  // namespace

void addEvaluateMemory(CLI::App& evaluate_app) {
  auto options = std::make_shared<MemoryCommand>();
  CLI::App* app = evaluate_app.add_subcommand(
      "memory", "Whether objects keep their ids from one visit to the next, and after a restart");
  app->add_option("run", options->run, "Folder of a run: objects_inst.csv, trajectory.tum")
      ->required();
  app->add_option("--truth", options->truth, "Simulated folder; with --places the true poses")
      ->required();
  const PlacesJudge judgedPlaces = addPlacesOptions(*app);
  app->add_option("--map-run", options->map_run,
                  "Folder of the run, over the same simulated folder, with whose map RUN began")
      ->excludes("--places");
  app->add_flag("--json", options->json, "Print JSON");
  app->callback([options, judgedPlaces] {
    if (judgedPlaces(options->run, options->truth, options->json)) return;
    const MemoryResult result = evaluateMemory(*options);
    if (options->json)
      std::cout << toJson(result).dump(2) << std::endl;
    else
      print(result);
  });
}

}  // namespace perdure::tools
