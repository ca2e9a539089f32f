// Simulated detections in the pipeline, on a generated folder: one car, five frames.
#include "tools/pipeline/simulated_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/common/replay/tiny_datasets.h"
#include "tools/base/config_folder.h"
#include "tools/pipeline/pipeline.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::readText;
using replay::startupErrorOf;
using replay::writeText;
using ::testing::HasSubstr;

/// The tiny EuRoC folder with truth: a car that fills a third of its 32×24 images.
fs::path tinySimulated(const std::string& name) {
  const auto root = replay::tinyEuroc(name);
  std::string states = "#timestamp, p, q w x y z, v, b_w, b_a\n";
  for (int i = 0; i < 60; ++i) {
    states += std::to_string(950'000'000 + 5'000'000 * i) + ",1,2,3,1,0,0,0,0,0,0,0,0,0,0,0,0\n";
  }
  writeText(root / "mav0/state_groundtruth_estimate0/data.csv", states);
  writeText(root / "objects_truth.json",
            R"({"objects": [{"id": 4, "class": "car", "looks_like": "car", "size": [4, 1.7, 1.5],
                "moves": false, "present_from_ns": 0, "present_until_ns": 9000000000,
                "keys": [{"time_ns": 0, "centre": [12, 2, 3], "yaw": 0.5}]}]})");
  std::string views = "frame,object_id,visible_fraction,x1,y1,x2,y2\n";
  for (int frame = 0; frame < 5; ++frame) views += std::to_string(frame) + ",4,1.0,6,6,18,16\n";
  writeText(root / "visibility_truth.csv", views);
  return root;
}

PipelineOptions optionsFor(const fs::path& root, const std::string& out) {
  PipelineOptions options;
  options.data = root.string();
  options.odometry = "truth";
  options.detections = "simulated";
  options.out = (root / out).string();
  options.assignments = {"detector.half_size=2", "detector.found=1", "detector.false_per_frame=0"};
  return options;
}

TEST(SimulatedDetections, AreDrawnForEachFrameOfTheFolder) {
  Pipeline pipeline(optionsFor(tinySimulated("drawn"), "out"));
  pipeline.run([](const PipelineCounts&) {});
  EXPECT_EQ(pipeline.counts().inferred, 5U);
  EXPECT_EQ(pipeline.counts().detections, 5U);
  EXPECT_TRUE(pipeline.reasons().at("semantic_filter").all().empty());
}

TEST(SimulatedDetections, TheSeedMakesThemAndTheSameSeedTheSame) {
  const auto root = tinySimulated("seeds");
  const auto bytesOf = [&](std::int64_t seed, const std::string& out) {
    auto options = optionsFor(root, out);
    options.assignments.push_back("detector.false_per_frame=5");
    options.seed = seed;
    Pipeline pipeline(options);
    pipeline.run([](const PipelineCounts&) {});
    pipeline.finish();
    return std::to_string(pipeline.counts().detections) + readText(root / out / "objects.json");
  };
  EXPECT_EQ(bytesOf(3, "a"), bytesOf(3, "b"));
  EXPECT_NE(bytesOf(3, "a"), bytesOf(4, "c"));
}

TEST(SimulatedDetections, ComeAfterTheirLatencyAndTheLastOnesAtTheEnd) {
  auto options = optionsFor(tinySimulated("late"), "out");
  options.assignments.push_back("detector.latency=0.12");  // the frames are 0.05 s apart
  Pipeline pipeline(options);
  pipeline.run([](const PipelineCounts&) {});
  EXPECT_EQ(pipeline.counts().inferred, 5U);
  EXPECT_EQ(pipeline.reasons().at("semantic_filter").of("detections_late"), 4U)
      << "the last frame waits for its detections to the end";
}

TEST(SimulatedDetections, LateOnesGiveThePosteriorOfThoseOnTime) {
  const auto root = tinySimulated("same");
  const auto objectsWith = [&](const std::string& latency) {
    auto options = optionsFor(root, "out" + latency);
    options.assignments.push_back("detector.latency=" + latency);
    Pipeline pipeline(options);
    pipeline.run([](const PipelineCounts&) {});
    pipeline.finish();
    return readText(fs::path(options.out) / "objects.json");
  };
  EXPECT_EQ(objectsWith("0"), objectsWith("0.1"));
  EXPECT_THAT(objectsWith("0"), HasSubstr("\"id\""));
}

TEST(SimulatedDetections, WhatCannotBeIsSaidWithTheFix) {
  const auto root = tinySimulated("wrong");
  auto options = optionsFor(root, "out");
  const auto error = [&] { return startupErrorOf([&] { Pipeline pipeline(options); }); };
  options.assignments = {"detector.confusion=[car van]"};
  EXPECT_THAT(error(), HasSubstr("write car/van=0.08"));
  options.assignments = {"detector.fuond=0.5"};
  EXPECT_THAT(error(), HasSubstr("found"));
  options.assignments = {"detector.confusion=[car/lorry=0.1]"};
  EXPECT_THAT(error(), HasSubstr("lorry"));
  options.assignments.clear();
  fs::remove(root / "visibility_truth.csv");
  EXPECT_THAT(error(), HasSubstr("visibility_truth.csv"));
  fs::remove(root / "objects_truth.json");
  EXPECT_THAT(error(), HasSubstr("make one with perdure simulate"));
}

TEST(SimulatedDetections, TheShippedFileHoldsTheDefaults) {
  DetectorConfig shipped, own;
  config::Fields shipped_fields, own_fields;
  describe(shipped, shipped_fields);
  describe(own, own_fields);
  config::refuse(
      config::readFile(shipped_fields, (configFolder() / "simulated_detector.yaml").string()));
  EXPECT_EQ(config::toYaml(shipped_fields), config::toYaml(own_fields));
  EXPECT_EQ(modelOf(own).confusion.size(), sim::DetectorModel().confusion.size());
  EXPECT_EQ(modelOf(own).confusion[0].share, sim::DetectorModel().confusion[0].share);
}

TEST(SimulatedDetections, TheTrackersFileIsReadAndItsBoxesAreNotDeclared) {
  DetectorConfig tracker;
  config::Fields fields;
  describe(tracker, fields);
  config::refuse(config::readFile(fields, (configFolder() / "simulated_tracker.yaml").string()));
  const sim::DetectorModel model = modelOf(tracker);
  EXPECT_GT(model.tail_share, 0.0);
  EXPECT_GT(model.error_time_s, 0.0);
  EXPECT_GT(model.coast_s, 0.0);
  EXPECT_EQ(model.boxes, BoxExtent::kOutline);
  EXPECT_FALSE(model.declare_boxes);
  tracker.boxes = "cuboid";
  EXPECT_EQ(modelOf(tracker).boxes, BoxExtent::kCuboid);
}

}  // namespace
}  // namespace perdure::tools
