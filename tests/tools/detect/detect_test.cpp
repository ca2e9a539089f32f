#include "tools/detect/detect.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "common/base/errors.h"
#include "common/replay/files/boxes/detection_file.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tests/services/inference/tiny_onnx.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

DetectOptions tinyOptions(const std::string& name) {
  DetectOptions options;
  options.data = replay::tinyEuroc(name);
  options.inference.model.path =
      inference::testing::TinyOnnx{}.write(replay::freshFolder(name + "_model"));
  options.inference.detection.merge_iou = 1.0;
  options.out = replay::freshFolder(name + "_out") / "detections.csv";
  return options;
}

TEST(Detect, WhatItWritesIsReadBackAsTheEvidenceOfTheNode) {
  const auto options = tinyOptions("detect_round_trip");
  const auto summary = detect(options, {});
  EXPECT_EQ(summary.frames, 5u);
  EXPECT_EQ(summary.failed, 0u);
  EXPECT_EQ(summary.boxes, 5u * 4u) << "one for each of the 2×2 cells";
  replay::DetectionFileOptions file;
  file.file = options.out;
  const auto read = replay::DetectionFile::read(file, replay::ClassAliases{});
  EXPECT_EQ(read.modelAt(4).classes, (std::vector<std::string>{"car", "person"}));
  const auto boxes = read.at(4);
  ASSERT_TRUE(boxes);
  ASSERT_EQ(boxes->size(), 4u);
  const Detection& d = boxes->front();
  EXPECT_NEAR(d.activations.at(1), 0.5 + std::log(3.0), 1e-5);
  EXPECT_NEAR(d.activations.at(2), -1.0 + std::log(3.0), 1e-5);
  ASSERT_TRUE(d.azimuth);
  EXPECT_NEAR(*d.azimuth, 3.14159265 * 5 / 8, 1e-5);
}

TEST(Detect, ScoreIsTheSoftMaxOfTheActivationsAndAzimuthMayBeMissing) {
  ModelInfo model;
  model.classes = {"chair", "couch"};
  Detection d;
  d.box = {1, 2, 3, 4};
  d.activations = {0.0F, -1.0F, 2.0F};
  std::ostringstream out;
  writeDetectionHeader(out, model);
  writeDetection(out, model, 7, d);
  const double p = std::exp(2.0) / (1 + std::exp(-1.0) + std::exp(2.0));
  EXPECT_THAT(out.str(), HasSubstr("sigma_y2,logit:chair,logit:couch\n7,couch,1,2,3,4,0.8"));
  EXPECT_NEAR(std::stod(out.str().substr(out.str().find("3,4,") + 4)), p, 1e-5);
  EXPECT_THAT(out.str(), HasSubstr(",,,-1,2\n"));
}

TEST(Detect, OfASceneWithSeveralSequencesTakesTheOneThatIsNamed) {
  auto options = tinyOptions("detect_scene");
  const fs::path scene = replay::freshFolder("detect_scenes");
  for (const char* name : {"seq-01", "seq-02"}) {
    fs::rename(replay::tinySevenScenes(std::string("detect_") + name), scene / name);
  }
  fs::remove(scene / "seq-02/frame-000002.color.png");
  options.data = scene;
  EXPECT_THAT(replay::startupErrorOf([&] { detect(options, {}); }), HasSubstr("--sequence"));
  options.sequence = "seq-01";
  EXPECT_EQ(detect(options, {}).frames, 3u);
}

TEST(Detect, SaysWhenItsFileCannotBeWritten) {
  auto options = tinyOptions("detect_unwritable");
  options.out = options.data / "none" / "detections.csv";
  const std::string message = replay::startupErrorOf([&] { detect(options, {}); });
  EXPECT_THAT(message, HasSubstr("cannot be written (No such file or directory); give --out"));
}

}  // namespace
}  // namespace perdure::tools
