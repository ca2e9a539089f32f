// `beliefs`: checks the calibration of the filter's beliefs over seeded worlds that match its
// model.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <map>

#include "common/base/errors.h"
#include "tests/scenario/beliefs/picture.h"
#include "tests/scenario/beliefs/trial.h"

namespace {

int run(int argc, char** argv) {
  using namespace perdure;  // NOLINT
  test::WorldOptions options;
  std::size_t runs = 50;
  std::vector<std::string> assignments, without;
  std::string picture;
  bool outliers = false;
  CLI::App app("Whether the semantic filter's beliefs are true, where the world is as it is told");
  app.add_option("--runs", runs, "Seeded worlds")->capture_default_str();
  app.add_option("--seed", options.seed, "Of the first")->capture_default_str();
  app.add_option("--frames", options.frames)->capture_default_str();
  app.add_option("--things-per-m", options.things_per_m)->capture_default_str();
  app.add_option("--tail", options.tail, "Degrees of freedom of the boxes' noise; 0: Gaussian");
  app.add_option("--set", assignments, "semantic_filter.KEY=VALUE or detector.KEY=VALUE");
  app.add_option(
      "--without", without,
      "Leave out: pose-noise, clutter, motion, screens, hiding, lasting, shared, azimuths");
  app.add_option("--picture", picture, "PNG with reliability diagrams and histograms");
  app.add_flag("--outliers", outliers, "Print the objects that are far from what they say");
  CLI11_PARSE(app, argc, argv);
  const std::map<std::string, bool*> parts{
      {"pose-noise", &options.pose_noise}, {"clutter", &options.clutter},
      {"motion", &options.motion},         {"screens", &options.screens},
      {"hiding", &options.hiding},         {"lasting", &options.lasting_errors},
      {"shared", &options.shared_looks},   {"azimuths", &options.azimuths}};
  for (const auto& name : without) {
    const auto part = parts.find(name);
    if (part == parts.end())
      throw StartupError(ExitCode::kUsage,
                         "--without " + name + ": is none of the parts that --help names");
    *part->second = false;
  }
  const auto scores = test::runWorlds(options, test::readTold(assignments), runs);
  print(scores);
  if (outliers) print(scores.outliers);
  if (!picture.empty()) test::drawBeliefs(scores, picture);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const perdure::StartupError& error) {
    std::cerr << error.what() << std::endl;
    return static_cast<int>(error.code());
  }
}
