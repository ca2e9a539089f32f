// `perdure evaluate memory --places`: scores the memory of a run on a user's own data.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "common/replay/dataset.h"
#include "tools/base/quantile.h"
#include "tools/evaluate/command.h"
#include "tools/evaluate/memory/places.h"
#include "tools/evaluate/trajectory_score.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct PlacesCommand {
  std::string places, data;
  bool body_poses = false;
  PlaceOptions options;
};

/// The frames with a true pose, and the mounting of the camera (or body) to which the poses belong.
struct PlacesTruth {
  std::map<TimePoint, std::pair<std::uint64_t, RigidTransform>> frames;  ///< number, T_PC
  RigidTransform T_BC;
};

/// Reads the true poses; frames and camera come from the run's data, which report.json names.
PlacesTruth readTruth(const fs::path& run, const std::string& poses_file,
                      const PlacesCommand& command) {
  if (!fs::is_directory(run)) {
    throw StartupError(ExitCode::kUnavailable,
                       run.string() + " is not a folder; name one that `perdure pipeline` wrote");
  }
  const auto poses = replay::PoseFile::read(
      poses_file, "with --places, --truth takes a file of the true poses of the camera");
  std::ifstream in(run / "report.json");
  Json report = Json::parse(in, nullptr, false);
  if (!report.is_object()) report = Json::object();
  const auto reported = [&report](const char* name) -> std::string {
    const auto found = report.find(name);
    return found != report.end() && found->is_string() ? found->get<std::string>() : "";
  };
  replay::DatasetOptions data;
  data.path = command.data.empty() ? reported("data") : command.data;
  data.sequence = reported("sequence");
  data.decode = false;
  if (poses.format() == replay::PoseFormat::kKitti) data.frame_count = poses.poses().size();
  if (data.path.empty()) {
    throw StartupError(ExitCode::kUsage,
                       run.string() + " has no report.json that names its data; give --data");
  }
  const auto dataset = replay::Dataset::open(data);
  PlacesTruth truth;
  const auto& cameras = dataset->calibration().cameras;
  if (cameras.empty() && !command.body_poses) {
    throw StartupError(ExitCode::kUnavailable,
                       data.path.string() +
                           " has no calibration of a camera; give the true poses "
                           "of the body, with --body-poses");
  }
  if (!command.body_poses) truth.T_BC = cameras.front().T_BC;
  for (std::uint64_t i = 0; i < dataset->frameCount(); ++i) {
    const auto time = dataset->frameTime(i);
    if (const auto T_PC = time ? poses.at(i, *time) : std::nullopt)
      truth.frames[*time] = {i, *T_PC};
  }
  return truth;
}

/// Horizontal ATE of the camera after alignment in yaw and position; null if `file` is missing.
Json ateOf(const fs::path& file, const PlacesTruth& truth) {
  if (!fs::exists(file)) return nullptr;
  const auto trajectory = replay::PoseFile::read(file);
  std::vector<PosePair> pairs;
  for (const auto& pose : trajectory.poses()) {
    const auto frame = truth.frames.find(pose.time);
    if (frame == truth.frames.end()) continue;
    pairs.push_back({pose.time, pose.T_WB * truth.T_BC, truth.T_BC * frame->second.second});
    pairs.back().estimate.p.z() = pairs.back().truth.p.z() = 0.0;
  }
  if (pairs.size() < 2) {
    throw StartupError(ExitCode::kUnavailable,
                       file.string() +
                           " has fewer than two frames in common with the true poses; "
                           "give those of the run's data to --truth");
  }
  return scoreTrajectory(pairs, Alignment::kYaw).ate_rmse_m;
}

PlaceScore scoreOf(const fs::path& run, const PlacesTruth& truth, const RunEvents& events,
                   const PlacesCommand& command) {
  const auto rows = readObjectRows(run / "objects_inst.csv");
  const auto trajectory = replay::PoseFile::read(run / "trajectory.tum");
  std::map<std::uint64_t, PlaceFrame> frames;
  for (const auto& pose : trajectory.poses()) {
    const auto frame = truth.frames.find(pose.time);
    if (frame == truth.frames.end()) continue;
    const auto& [number, T_PC] = frame->second;
    frames[number] = {pose.T_WB, pose.T_WB * truth.T_BC * T_PC.inverse(), {}};
  }
  for (const EstimateRow& row : rows) {
    if (const auto at = frames.find(row.frame); at != frames.end()) at->second.rows.push_back(&row);
  }
  return scorePlaces(readPlaces(command.places), frames, events, command.options);
}

Json judge(const fs::path& run, const std::string& poses, const PlacesCommand& command) {
  const PlacesTruth truth = readTruth(run, poses, command);
  const Json ate = ateOf(run / "trajectory.tum", truth);
  RunEvents events = readRunEvents(run / "events.jsonl");
  const PlaceScore s = scoreOf(run, truth, events, command);
  const std::uint64_t asked = s.first_asked + s.later_asked;
  if (asked == 0) {
    throw StartupError(ExitCode::kData, command.places +
                                            ": no place is within --range in one of its frames "
                                            "that the run has; are places and true poses in one "
                                            "frame, and frames counted from 0?");
  }
  const auto share = [](std::uint64_t part, std::uint64_t whole) -> Json {
    if (whole == 0) return nullptr;
    return static_cast<double>(part) / static_cast<double>(whole);
  };
  return {{"places_visited_twice", s.visited_twice},
          {"ids_kept", share(s.kept, s.visited_twice)},
          {"ids_kept_in_visit", share(s.kept_in_visit, s.visited_twice)},
          {"without_object_in_a_visit", s.without},
          {"sightings", asked},
          {"recall", share(s.first_found + s.later_found, asked)},
          {"recall_first_visit", share(s.first_found, s.first_asked)},
          {"recall_later_visits", share(s.later_found, s.later_asked)},
          {"along_m", s.along_m.empty() ? Json() : Json(quantile(s.along_m, 0.5))},
          {"across_m", s.across_m.empty() ? Json() : Json(quantile(s.across_m, 0.5))},
          {"loops", events.counts["loop_closed"]},
          {"gone", events.counts["gone"]},
          {"moved", events.counts["moved"]},
          {"ate_odometry_m", ate},
          {"ate_map_m", ateOf(run / "trajectory_map.tum", truth)}};
}

void refuseLimits(const char* name, const std::vector<double>& limits) {
  if (limits[0] < limits[1] && std::isfinite(limits[0] - limits[1])) return;
  throw StartupError(ExitCode::kUsage,
                     "{}: the limits are {:g} and {:g}; the second must be larger, and both finite",
                     name, limits[0], limits[1]);
}

}  // namespace

PlacesJudge addPlacesOptions(CLI::App& memory) {
  auto command = std::make_shared<PlacesCommand>();
  PlaceOptions& options = command->options;
  CLI::Option* places = memory.add_option(
      "--places", command->places,
      "CSV place,visit,x,y,z,frames: places of objects at rest in the frame of the true poses, "
      "with the frames of each visit; --truth is then a file of the camera's true poses");
  for (CLI::Option* option :
       {memory.add_flag("--body-poses", command->body_poses, "The true poses are the body's"),
        memory.add_option("--data", command->data, "The run's data, if they were moved"),
        memory.add_option("--class", options.class_name, "Class of the objects; else all"),
        memory.add_option("--range", options.range_m, "Distances from the body for the recall, m"),
        memory.add_option("--along", options.along_m,
                          "Limits of an object behind its place, along the ray from the body, m"),
        memory.add_option("--across", options.across_m, "Its largest distance from the ray, m"),
        memory
            .add_option("--least-frames", options.least_frames,
                        "Visits with fewer frames are not counted")
            ->check(CLI::Range(1, 1000000))}) {
    option->needs(places)->capture_default_str();
  }
  for (const char* pair : {"--range", "--along"}) memory.get_option(pair)->expected(2);
  return [command](const std::string& run, const std::string& truth, bool as_json) {
    if (command->places.empty()) return false;
    refuseLimits("--range", command->options.range_m);
    refuseLimits("--along", command->options.along_m);
    refuseLimits("--across", {0.0, command->options.across_m});
    const Json result = judge(run, truth, *command);
    if (as_json) std::cout << result.dump(2) << std::endl;
    for (const auto& [name, value] : result.items()) {
      if (as_json) break;
      fmt::print(
          "{}: {}\n", name,
          value.is_number_float() ? fmt::format("{:.3f}", value.get<double>()) : value.dump());
    }
    return true;
  };
}

}  // namespace perdure::tools
