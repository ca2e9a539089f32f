// `perdure evaluate consistency`: ANEES of the map's objects and of odometry against ground truth.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "common/math/so3.h"
#include "common/replay/dataset.h"
#include "tools/evaluate/command.h"
#include "tools/evaluate/consistency_score.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

struct ConsistencyOptions {
  std::string out, truth;
  double within_m = 3.0;
  bool json = false;
};

struct Consistency {
  std::optional<ConsistencyScore> objects;
  std::optional<OdometryScore> odometry;
};

/// Transform from the truth's world to the run's W, from yaw and position of the first common pose.
RigidTransform alignedAtTheStart(const SimulatedTruth& truth,
                                 const std::vector<replay::StampedPose>& trajectory) {
  for (const auto& pose : trajectory) {
    const auto there = truth.body.at(0, pose.time);
    if (!there) continue;
    return placedOn(pose.T_WB, *there);
  }
  throw StartupError(ExitCode::kUnavailable,
                     "the trajectory has no time in common with the truth; name the simulated "
                     "folder over which the run went");
}

nlohmann::ordered_json toJson(const Anees& anees) {
  return {{"what", anees.what},          {"dof", anees.dof},
          {"number", anees.nees.size()}, {"mean_per_dof", anees.mean()},
          {"median", anees.median()},    {"within_3_sigma", anees.within3Sigma()}};
}

nlohmann::ordered_json toJson(const Consistency& consistency) {
  nlohmann::ordered_json json;
  if (const auto& score = consistency.objects) {
    json = {{"objects", score->objects}, {"left_out", score->left_out}};
    for (const Anees* anees : {&score->position, &score->yaw, &score->half_yaw, &score->size}) {
      json["anees"].push_back(toJson(*anees));
      const auto [low, high] = anees->band();
      json["anees"].back()["band_95"] = {low, high};
    }
  }
  if (const auto& score = consistency.odometry) {
    for (const Anees* anees : {&score->orientation, &score->position, &score->velocity}) {
      json["odometry"].push_back(toJson(*anees));
    }
  }
  return json;
}

void print(const Anees& anees, const std::string& band) {
  fmt::print("{:<26} {:14.2f} {:>16} {:10.2f} {:14.3f}\n", anees.what, anees.mean(), band,
             anees.median(), anees.within3Sigma());
}

void print(const Consistency& consistency) {
  if (consistency.objects) {
    fmt::print("{} objects of the map with a true one, {} without\n", consistency.objects->objects,
               consistency.objects->left_out);
  }
  fmt::print("{:<26} {:>14} {:>16} {:>10} {:>14}\n", "", "NEES per dof", "95 % band", "median",
             "within 3 sigma");
  if (const auto& score = consistency.objects) {
    for (const Anees* anees : {&score->position, &score->yaw, &score->half_yaw, &score->size}) {
      const auto [low, high] = anees->band();
      print(*anees, fmt::format("{:.2f} .. {:.2f}", low, high));
    }
  }
  if (const auto& score = consistency.odometry) {
    for (const Anees* anees : {&score->orientation, &score->position, &score->velocity}) {
      print(*anees, "one run: none");
    }
  }
}

/// Reads the true trajectory from a dataset folder (not one with several sequences) or a TUM file.
replay::PoseFile truePoses(const std::string& truth) {
  if (!fs::is_directory(truth))
    return replay::PoseFile::read(truth, "--truth takes a file of poses or a dataset folder");
  replay::DatasetOptions options;
  options.path = truth;
  options.decode = false;
  if (const auto poses = replay::Dataset::open(options)->truth()) return *poses;
  throw StartupError(ExitCode::kUnavailable,
                     truth + " holds no true trajectory; give a TUM file to --truth");
}

void run(const ConsistencyOptions& options) {
  const fs::path out = options.out;
  Consistency consistency;
  replay::PoseFile poses(replay::PoseFormat::kTum, {});
  if (isSimulated(options.truth)) {
    const SimulatedTruth truth = readSimulatedTruth(options.truth);
    const auto trajectory =
        replay::PoseFile::read(out / "trajectory.tum", "`perdure pipeline` writes it").poses();
    consistency.objects = scoreConsistency(readBeliefs(out / "objects.json"), truth.truth,
                                           alignedAtTheStart(truth, trajectory), options.within_m);
    poses = truth.body;
  } else {
    poses = truePoses(options.truth);
  }
  if (poses.format() == replay::PoseFormat::kTum) {
    consistency.odometry = scoreOdometry(readOdometry(out / "odometry.csv"), poses);
  }
  if (options.json)
    std::cout << toJson(consistency).dump(2) << std::endl;
  else
    print(consistency);
}

}  // namespace

void addEvaluateConsistency(CLI::App& evaluate_app) {
  auto options = std::make_shared<ConsistencyOptions>();
  CLI::App* app = evaluate_app.add_subcommand(
      "consistency", "Whether the covariances of a run's objects and odometry are honest");
  app->add_option("out", options->out, "Folder of a run: objects.json, odometry.csv")->required();
  app->add_option("--truth", options->truth,
                  "Simulated folder; for odometry alone: EuRoC folder or TUM file")
      ->required();
  app->add_option("--within", options->within_m, "Metres from a true object that an error may be")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app->add_flag("--json", options->json, "Print JSON");
  app->callback([options] { run(*options); });
}

}  // namespace perdure::tools
