// A run without results reports the cause: before it starts, or at its end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tests/tools/data_check/turning_drive.h"
#include "tools/pipeline/pipeline.h"
#include "tools/pipeline/report.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::readText;
using replay::writeText;
using testing::AllOf;
using testing::HasSubstr;
using tests::makeTurningDrive;
using tests::TurningDrive;

PipelineOptions optionsFor(const fs::path& root) {
  PipelineOptions options;
  options.data = root.string();
  options.odometry = "vio";
  options.detections = "none";
  options.out = (root / "out").string();
  return options;
}
/// Message and status of a run; "" and 0 if it ends normally.
std::pair<std::string, int> endOf(const PipelineOptions& options) {
  try {
    Pipeline pipeline(options);
    pipeline.run([](const PipelineCounts&) {});
    pipeline.finish();
    pipeline.outputs().writeJson("report.json", makeReport(pipeline, options));
    pipeline.refuseNothing();
  } catch (const StartupError& error) {
    return {error.what(), static_cast<int>(error.code())};
  }
  return {};
}
std::pair<std::string, int> endOf(const std::string& name, const TurningDrive& drive) {
  return endOf(optionsFor(makeTurningDrive(name, drive)));
}

TEST(PipelineRefusal, UnitsAreToldBeforeTheRun) {
  TurningDrive drive;
  drive.change = [](ImuSample& sample) { sample.accel /= 9.80665; };
  EXPECT_THAT(endOf("run_in_g", drive), testing::Pair(HasSubstr("the unit is g"), 65));
  drive.change = [](ImuSample& sample) { sample.gyro *= 180.0 / M_PI; };
  EXPECT_THAT(endOf("run_in_degrees", drive), testing::Pair(HasSubstr("degrees"), 65));
  drive = {};
  drive.written_T_BC = tests::trueCameraPlace().inverse();
  EXPECT_THAT(endOf("run_inverted", drive), testing::Pair(HasSubstr("wrong way round"), 65));
}

TEST(PipelineRefusal, WithoutTheImuItsUnitsDoNotMatter) {
  TurningDrive drive;
  drive.seconds = 1.0;
  drive.change = [](ImuSample& sample) { sample.accel /= 9.80665; };
  const auto root = makeTurningDrive("poses_for_g", drive);
  auto options = optionsFor(root);
  options.odometry = (root / "poses.tum").string();
  writeText(options.odometry, "1000000000.0 0 0 0 0 0 0 1\n1000000001.0 1 0 0 0 0 0 1\n");
  options.assignments = {};
  EXPECT_THAT(endOf(options).second, 0) << "poses at most .5 s apart, but the ends are exact";
}

TEST(PipelineRefusal, ACameraThatTheDriveLacksIsTold) {
  auto options = optionsFor(makeTurningDrive("unknown_camera"));
  EXPECT_TRUE(Pipeline(options).findings().empty());
  options.assignments = {"vio.input.cameras=[left]"};
  const auto findings = Pipeline(options).findings();
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, "camera_unknown");
  EXPECT_THAT(findings[0].text, HasSubstr("names left, which the calibration does not (cam0)"));
}

TEST(PipelineRefusal, OneFrameIsNoDrive) {
  auto options = optionsFor(makeTurningDrive("one_frame"));
  options.every = 1000;
  EXPECT_THAT(endOf(options), testing::Pair(HasSubstr("--every 1000 leaves one frame"), 65));
}

TEST(PipelineRefusal, WhereNoImageCanBeReadTheFirstOneIsNamed) {
  const auto root = makeTurningDrive("unreadable");
  for (const auto& entry : fs::directory_iterator(root / "mav0/cam0/data")) {
    replay::truncate(entry.path(), 0.5);
  }
  EXPECT_THAT(endOf(optionsFor(root)),
              testing::Pair(AllOf(HasSubstr("no image of cam0 that was tried"),
                                  HasSubstr("1000000000000000000.png"), HasSubstr("is missing")),
                            65));
  EXPECT_FALSE(fs::exists(root / "out"));
}

TEST(PipelineRefusal, ResultsAreNotWrittenBetweenTheImages) {
  auto options = optionsFor(makeTurningDrive("out_inside"));
  options.out = options.data + "/mav0/cam0/data/out";
  EXPECT_THAT(endOf(options), testing::Pair(HasSubstr("lies in the data"), 64));
  EXPECT_FALSE(fs::exists(options.out));
}

TEST(PipelineRefusal, PosesOfAnotherEpochAreShownBesideTheFrames) {
  const auto root = makeTurningDrive("poses_elsewhen");
  auto options = optionsFor(root);
  options.odometry = (root / "poses.tum").string();
  writeText(options.odometry, "5.0 0 0 0 0 0 0 1\n6.0 1 0 0 0 0 0 1\n");
  EXPECT_THAT(endOf(options), testing::Pair(AllOf(HasSubstr("no frame has a pose"),
                                                  HasSubstr("5000000000 … 6000000000")),
                                            65));
}

TEST(PipelineRefusal, NoPoseOfVioSaysItsReasons) {
  TurningDrive drive;
  drive.seconds = 0.2;
  EXPECT_THAT(endOf("too_short", drive), testing::Pair(HasSubstr("no pose came of 5 frames"), 65));
}

TEST(PipelineRefusal, DetectionsOfOtherFramesAreRefusedBeforeTheRun) {
  const auto root = makeTurningDrive("other_frames");
  auto options = optionsFor(root);
  options.detections = (root / "boxes.csv").string();
  writeText(options.detections, "frame,class,x1,y1,x2,y2,score\n900,car,1,2,30,40,0.9\n");
  EXPECT_THAT(endOf(options), testing::Pair(AllOf(HasSubstr("none of its 1 rows"),
                                                  HasSubstr("(0 … 40)"), HasSubstr("900 … 900")),
                                            65));
}

TEST(PipelineRefusal, DetectionsThatCountFromOneAreRefusedAndBoxesBeyondTheDriveAreSaid) {
  const auto root = makeTurningDrive("from_one");
  auto options = optionsFor(root);
  options.detections = (root / "boxes.csv").string();
  const std::string header = "frame,class,x1,y1,x2,y2,score\n", box = ",car,1,2,30,40,0.9\n";
  writeText(options.detections, header + "1" + box + "41" + box);
  EXPECT_THAT(endOf(options), testing::Pair(HasSubstr("1 … 41, those of the drive 0 … 40"), 65));
  writeText(options.detections, header + "0" + box + "40" + box + "60" + box);
  const Pipeline pipeline(options);
  EXPECT_THAT(endOfLine(pipeline.doubts()), HasSubstr("boxes_beyond"));
  EXPECT_THAT(pipeline.findings().back().text, HasSubstr("1 of 3 boxes"));
}

TEST(PipelineRefusal, UnknownClassesAreSaid) {
  const auto root = makeTurningDrive("odd_boxes");
  auto options = optionsFor(root);
  options.detections = (root / "boxes.csv").string();
  std::string text = "frame,class,x1,y1,x2,y2,score\n";
  for (int k = 0; k <= 20; ++k) {
    text += std::to_string(k) + (k < 20 ? ",2" : ",bicycl") + ",1,2,30,40,0.9\n";
  }
  writeText(options.detections, text);
  const Pipeline pipeline(options);
  EXPECT_THAT(endOfLine(pipeline.doubts()), HasSubstr("classes_unknown"));
  EXPECT_THAT(pipeline.findings().back().text,
              AllOf(HasSubstr("2 (20 boxes, a number: write the name)"),
                    HasSubstr("bicycl (1 boxes; do you mean bicycle?)")));
}

/// Twenty poses along x, `step_m` apart.
std::string posesAlongX(double step_m) {
  std::string poses;
  for (int i = 0; i <= 20; ++i) {
    poses += "100000000" + std::to_string(i / 10) + "." + std::to_string(i % 10) + " " +
             std::to_string(step_m * i) + " 0 0 0 0 0 1\n";
  }
  return poses;
}

TEST(PipelineRefusal, AnEmptyMapWithDetectionsIsNoSuccess) {
  const auto root = makeTurningDrive("empty_map");
  auto options = optionsFor(root);
  options.odometry = (root / "poses.tum").string();
  writeText(options.odometry, posesAlongX(0.2));
  options.detections = (root / "boxes.csv").string();
  writeText(options.detections, "frame,class,x1,y1,x2,y2,score\n3,car,1,2,30,40,0.2\n");
  EXPECT_THAT(endOf(options), testing::Pair(HasSubstr("the map is empty"), 65));
  EXPECT_TRUE(fs::exists(root / "out/trajectory.tum")) << "what there is is written";
  writeText(options.odometry, posesAlongX(0.02));
  options.out = (root / "hardly_moved").string();
  EXPECT_THAT(endOf(options), testing::Pair(HasSubstr("the camera moved by 0.4 m"), 65));
}

TEST(PipelineRefusal, WhatWasRepairedIsInTheReport) {
  const auto root = makeTurningDrive("repaired");
  for (const auto& entry : fs::directory_iterator(root / "mav0/cam0/data")) {
    fs::rename(entry.path(), fs::path(entry.path()).replace_extension(".PNG"));
  }
  auto options = optionsFor(root);
  options.odometry = (root / "poses.tum").string();
  writeText(options.odometry, "1000000000.0 0 0 0 0 0 0 1\n1000000000.4 1 0 0 0 0 0 1\n");
  EXPECT_EQ(endOf(options).second, 0);
  options.out = (root / "with_images").string();
  options.odometry = "vio";
  (void)endOf(options);
  const auto report = nlohmann::json::parse(readText(root / "with_images/report.json"));
  EXPECT_THAT(report["data_check"]["notes"].dump(), HasSubstr("41 of 41 images"));
}

}  // namespace
}  // namespace perdure::tools
