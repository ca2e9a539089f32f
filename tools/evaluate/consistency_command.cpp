// `perdure evaluate consistency`: ANEES of the map's objects against a simulated folder.
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "common/math/so3.h"
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

/// The truth's world in the run's, by yaw and position at the first pose that both know.
RigidTransform alignedAtTheStart(const SimulatedTruth& truth,
                                 const std::vector<replay::StampedPose>& trajectory) {
  for (const auto& pose : trajectory) {
    const auto there = truth.body.at(0, pose.time);
    if (!there) continue;
    const double yaw = wrapAngle(yawOf(pose.T_WB.R()) - yawOf(there->R()));
    const Eigen::Matrix3d R = rotationAboutZ(yaw);
    return RigidTransform(R, Eigen::Vector3d(pose.T_WB.p - R * there->p));
  }
  throw StartupError(ExitCode::kUnavailable,
                     "the trajectory has no time in common with the truth; name the simulated "
                     "folder over which the run went");
}

nlohmann::ordered_json toJson(const ConsistencyScore& score) {
  nlohmann::ordered_json json = {{"objects", score.objects}, {"left_out", score.left_out}};
  for (const Anees* anees : {&score.position, &score.yaw, &score.half_yaw, &score.size}) {
    const auto [low, high] = anees->band();
    json["anees"].push_back({{"what", anees->what},
                             {"dof", anees->dof},
                             {"mean_per_dof", anees->mean()},
                             {"band_95", {low, high}},
                             {"median", anees->median()},
                             {"within_3_sigma", anees->within3Sigma()}});
  }
  return json;
}

void print(const ConsistencyScore& score) {
  std::printf("%llu objects of the map with a true one, %llu without\n",
              static_cast<unsigned long long>(score.objects),
              static_cast<unsigned long long>(score.left_out));
  std::printf("%-26s %14s %16s %10s %14s\n", "", "NEES per dof", "95 % band", "median",
              "within 3 sigma");
  for (const Anees* anees : {&score.position, &score.yaw, &score.half_yaw, &score.size}) {
    const auto [low, high] = anees->band();
    std::printf("%-26s %14.2f %7.2f .. %5.2f %10.2f %14.3f\n", anees->what.c_str(), anees->mean(),
                low, high, anees->median(), anees->within3Sigma());
  }
}

void run(const ConsistencyOptions& options) {
  const SimulatedTruth truth = readSimulatedTruth(options.truth);
  const auto trajectory = replay::PoseFile::read(fs::path(options.out) / "trajectory.tum").poses();
  const ConsistencyScore score =
      scoreConsistency(readBeliefs(fs::path(options.out) / "objects.json"), truth.truth,
                       alignedAtTheStart(truth, trajectory), options.within_m);
  if (options.json)
    std::cout << toJson(score).dump(2) << std::endl;
  else
    print(score);
}

}  // namespace

void addEvaluateConsistency(CLI::App& evaluate_app) {
  auto options = std::make_shared<ConsistencyOptions>();
  CLI::App* app = evaluate_app.add_subcommand(
      "consistency", "Whether the covariances of a run's objects are honest, by simulated truth");
  app->add_option("out", options->out, "Folder of a run: objects.json, trajectory.tum")->required();
  app->add_option("--truth", options->truth, "The simulated folder")->required();
  app->add_option("--within", options->within_m, "Metres from a true object that an error may be")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app->add_flag("--json", options->json, "Print JSON");
  app->callback([options] { run(*options); });
}

}  // namespace perdure::tools
