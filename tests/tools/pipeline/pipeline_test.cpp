// The pipeline on a generated street with one parked car: exact boxes of a known cuboid.
#include "tools/pipeline/pipeline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/camera/camera_model.h"
#include "common/math/so3.h"
#include "common/replay/files/kitti_calibration.h"
#include "common/replay/files/text_file.h"
#include "common/replay/recordings/recorded_messages.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tools/evaluate/object_rows.h"
#include "tools/perdure/commands.h"
#include "tools/pipeline/report.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::readText;
using replay::startupErrorOf;
using replay::writeText;
using ::testing::HasSubstr;

constexpr int kFrames = 60;
const Eigen::Vector3d kCarCentre(32.0, 3.5, -0.9), kCarSize(4.2, 1.7, 1.5);
constexpr double kCarYaw = 0.1;

RigidTransform poseOf(int frame) {
  return RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.4 * frame, 0, 0));
}

/// The box of the car in a frame, cut at the image border as detectors do; nothing if less than a
/// fifth of it is in the image.
std::optional<Box> boxOf(const CameraModel& camera, int frame) {
  const RigidTransform T_CW = (poseOf(frame) * camera.T_BC()).inverse();
  Box box{1e9, 1e9, -1e9, -1e9};
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d half(corner & 1 ? .5 : -.5, corner & 2 ? .5 : -.5, corner & 4 ? .5 : -.5);
    const auto pixel =
        camera.project(T_CW * (kCarCentre + rotationAboutZ(kCarYaw) * half.cwiseProduct(kCarSize)));
    if (!pixel) return std::nullopt;
    box = Box{std::min(box.x1, pixel->x()), std::min(box.y1, pixel->y()),
              std::max(box.x2, pixel->x()), std::max(box.y2, pixel->y())};
  }
  const Box cut{std::max(box.x1, 0.0), std::max(box.y1, 0.0), std::min(box.x2, camera.width() - 1),
                std::min(box.y2, camera.height() - 1)};
  if (cut.width() <= 0 || cut.height() <= 0 || cut.area() < 0.2 * box.area()) return std::nullopt;
  return cut;
}

/// Creates the folder with a calibration, poses.txt and boxes.csv.
fs::path makeStreet(const std::string& name) {
  const fs::path root = replay::tinyKittiTracking(name);
  fs::remove_all(root / "label_02");
  fs::remove_all(root / "image_02");
  writeText(root / "calib/0000.txt",
            "P2: 720 0 620 44 0 720 180 0.2 0 0 1 0\nP3: 720 0 620 -340 0 720 180 0.2 0 0 1 0\n"
            "R0_rect: 1 0 0 0 1 0 0 0 1\n"
            "Tr_velo_to_cam: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3\n"
            "Tr_imu_to_velo: 1 0 0 -0.8 0 1 0 0.3 0 0 1 -0.8\n");
  auto calibration = replay::readTrackingCalibration(root / "calib/0000.txt");
  calibration.width = 1242, calibration.height = 375;
  const CameraModel camera(calibration.camera("cam0"));
  std::string poses, boxes = "frame,class,x1,y1,x2,y2,score\n";
  for (int frame = 0; frame < kFrames; ++frame) {
    const double x = poseOf(frame).p.x();
    poses += "1 0 0 " + std::to_string(x) + " 0 1 0 0 0 0 1 0\n";
    const auto box = boxOf(camera, frame);
    if (!box) continue;
    boxes += std::to_string(frame) + ",Car," + std::to_string(box->x1) + "," +
             std::to_string(box->y1) + "," + std::to_string(box->x2) + "," +
             std::to_string(box->y2) + ",0.95\n";
  }
  writeText(root / "poses.txt", poses);
  writeText(root / "boxes.csv", boxes);
  return root;
}

PipelineOptions streetOptions(const fs::path& street, const std::string& out) {
  PipelineOptions options;
  options.data = street.string();
  options.sequence = "0000";
  options.odometry = (street / "poses.txt").string();
  options.detections = (street / "boxes.csv").string();
  options.out = (street / out).string();
  return options;
}

void runPipeline(const PipelineOptions& options) {
  Pipeline pipeline(options);
  pipeline.run([](const PipelineCounts&) {});
  pipeline.finish();
  pipeline.outputs().writeJson("report.json", makeReport(pipeline, options));
}

std::string errorOf(const PipelineOptions& options) {
  return startupErrorOf([&] { Pipeline pipeline(options); });
}

TEST(Pipeline, AParkedCarIsOneObjectWhereItStands) {
  const auto street = makeStreet("parked");
  const auto options = streetOptions(street, "out");
  runPipeline(options);
  const auto rows = readObjectRows(fs::path(options.out) / "objects_final.csv");
  ASSERT_GT(rows.size(), 40U);
  for (const auto& row : rows) {
    EXPECT_EQ(row.id, rows.front().id);
    EXPECT_EQ(row.class_name, "car");
    EXPECT_LT((row.centre_W - kCarCentre).norm(), 1.0) << row.centre_W.transpose();
    EXPECT_EQ(toNanoseconds(row.time), static_cast<std::int64_t>(row.frame) * 100'000'000);
  }
  const auto objects = nlohmann::json::parse(readText(fs::path(options.out) / "objects.json"));
  ASSERT_EQ(objects["objects"].size(), 1U);
  EXPECT_GT(objects["objects"][0]["existence"], 0.5);
  EXPECT_GT(objects["objects"][0]["pmf"]["car"], 0.5);
}

TEST(Pipeline, EveryDeclaredFileIsThereAndParses) {
  const auto options = streetOptions(makeStreet("files"), "out");
  runPipeline(options);
  const fs::path out = options.out;
  for (const char* file : {"objects.json", "map.geojson", "timing.json", "report.json"}) {
    EXPECT_TRUE(nlohmann::json::accept(readText(out / file))) << file;
  }
  const auto report = nlohmann::json::parse(readText(out / "report.json"));
  EXPECT_EQ(report["services"]["capture"]["frames_in"], kFrames);
  EXPECT_EQ(report["services"]["semantic_filter"]["frames_out"], kFrames);
  const auto timing = nlohmann::json::parse(readText(out / "timing.json"));
  EXPECT_EQ(timing["stages"]["semantic_filter"]["calls"], kFrames);
  EXPECT_EQ(replay::PoseFile::read(out / "trajectory.tum").poses().size(), std::size_t{kFrames});
  EXPECT_TRUE(fs::exists(out / "events.jsonl"));
  EXPECT_TRUE(fs::exists(out / "objects_inst.csv"));
}

TEST(Pipeline, TwoRunsGiveIdenticalBytes) {
  const auto street = makeStreet("twice");
  runPipeline(streetOptions(street, "one"));
  runPipeline(streetOptions(street, "two"));
  for (const char* file : {"objects_inst.csv", "objects_final.csv", "objects.json", "events.jsonl",
                           "trajectory.tum", "map.geojson"}) {
    EXPECT_EQ(readText(street / "one" / file), readText(street / "two" / file)) << file;
  }
}

TEST(Pipeline, InstUpToAFrameDoesNotDependOnWhatComesLater) {
  const auto street = makeStreet("prefix");
  runPipeline(streetOptions(street, "whole"));
  // From frame 30 on, all boxes are of another class and elsewhere.
  std::string csv;
  for (const auto& line : replay::readLines(street / "boxes.csv", "")) {
    const auto frame = replay::parseInteger(replay::split(line.text, ',')[0]);
    if (frame.value_or(0) < 30) csv += line.text + "\n";
  }
  writeText(street / "cut.csv", csv + "30,Van,100,100,200,180,0.9\n");
  auto options = streetOptions(street, "cut");
  options.detections = (street / "cut.csv").string();
  runPipeline(options);
  const auto upTo = [&](const char* run) {
    std::string text;
    for (const auto& line : replay::readLines(street / run / "objects_inst.csv", "")) {
      const auto frame = replay::parseInteger(replay::split(line.text, ',')[1]);
      if (frame.value_or(0) < 30) text += line.text + "\n";
    }
    return text;
  };
  EXPECT_EQ(upTo("whole"), upTo("cut"));
  EXPECT_GT(upTo("whole").size(), 200U) << "there is something to compare";
}

TEST(Pipeline, SecondsEndTheRun) {
  auto options = streetOptions(makeStreet("seconds"), "out");
  options.seconds = 1.0;
  runPipeline(options);
  const auto poses = replay::PoseFile::read(fs::path(options.out) / "trajectory.tum").poses();
  EXPECT_EQ(poses.size(), 11U);
}

TEST(Pipeline, FromBeginsLaterAndLeavesTheNumbersOfTheFrames) {
  const auto street = makeStreet("from");
  auto options = streetOptions(street, "whole");
  runPipeline(options);
  options.out = (street / "late").string();
  options.from = 0.95;
  options.seconds = 3.0;
  runPipeline(options);
  const auto whole = replay::PoseFile::read(street / "whole/trajectory.tum").poses();
  const auto late = replay::PoseFile::read(street / "late/trajectory.tum").poses();
  ASSERT_EQ(late.size(), 31U);
  EXPECT_EQ(late.front().time, whole[10].time);
  EXPECT_EQ(late.front().T_WB.p, whole[10].T_WB.p);
  const auto rows = readObjectRows(street / "late/objects_inst.csv");
  ASSERT_FALSE(rows.empty());
  EXPECT_GE(rows.front().frame, 10U);
  EXPECT_LE(rows.back().frame, 40U);
  options.from = 6.0;
  EXPECT_THAT(errorOf(options), HasSubstr("give fewer seconds"));
  options.odometry = options.detections = "recorded";
  EXPECT_THAT(errorOf(options), HasSubstr("--from"));
}

TEST(Pipeline, EachNthFrameIsARunOfALowerRate) {
  const auto street = makeStreet("every");
  auto options = streetOptions(street, "whole");
  runPipeline(options);
  options.out = (street / "third").string();
  options.every = 3;
  runPipeline(options);
  const auto whole = replay::PoseFile::read(street / "whole/trajectory.tum").poses();
  const auto third = replay::PoseFile::read(street / "third/trajectory.tum").poses();
  ASSERT_EQ(third.size(), (whole.size() + 2) / 3);
  EXPECT_EQ(third[1].time, whole[3].time);
  EXPECT_EQ(third[1].T_WB.p, whole[3].T_WB.p);
  const auto rows = readObjectRows(street / "third/objects_inst.csv");
  ASSERT_FALSE(rows.empty());
  for (const auto& row : rows) EXPECT_EQ(row.frame % 3, 0U);
  options.odometry = options.detections = "recorded";
  EXPECT_THAT(errorOf(options), HasSubstr("--every"));
}

/// Writes the car's label for each frame that has its box.
void labelStreet(const fs::path& street) {
  auto calibration = replay::readTrackingCalibration(street / "calib/0000.txt");
  calibration.width = 1242, calibration.height = 375;
  const CameraModel camera(calibration.camera("cam0"));
  std::string labels;
  for (int frame = 0; frame < kFrames; ++frame) {
    const auto box = boxOf(camera, frame);
    const Eigen::Vector3d at = calibration.T_RI * (poseOf(frame).inverse() * kCarCentre);
    char line[200];
    std::snprintf(line, sizeof line, "%d 3 Car 0 0 0 %f %f %f %f 1.5 1.7 4.2 %f %f %f %f\n", frame,
                  box ? box->x1 : 0.0, box ? box->y1 : 0.0, box ? box->x2 : 9.0,
                  box ? box->y2 : 9.0, at.x(), at.y() + 0.75, at.z(), -kCarYaw - M_PI_2);
    labels += line;
  }
  writeText(street / "label_02/0000.txt", labels);
}

void evaluateObjects(const PipelineOptions& options) {
  CLI::App app;
  setUpEvaluate(app);
  app.parse("objects " + options.out + "/objects_final.csv --sequence 0000 --truth " +
            options.data + " --image-size 1242 375 --json");
}

nlohmann::json evaluated(const PipelineOptions& options) {
  ::testing::internal::CaptureStdout();
  evaluateObjects(options);
  std::fflush(stdout);
  return nlohmann::json::parse(::testing::internal::GetCapturedStdout());
}

TEST(Pipeline, FramesThatItLeavesOutAreNoMisses) {
  const auto street = makeStreet("left_out");
  labelStreet(street);
  auto options = streetOptions(street, "out");
  options.image_size = {1242, 375};
  const auto recall = [](const nlohmann::json& json) {
    return json["cells"][5]["recall"].get<double>();  // recall within a metre, at any angle
  };
  runPipeline(options);
  const auto whole = evaluated(options);
  EXPECT_EQ(whole["frames_left_out"], 0);
  EXPECT_GT(recall(whole), 0.9);
  options.every = 3;
  options.seconds = 4.05;
  runPipeline(options);
  const auto report = nlohmann::json::parse(readText(fs::path(options.out) / "report.json"));
  EXPECT_EQ(report["frames"]["runs"].dump(), "[[0,39,3]]");
  const auto third = evaluated(options);
  EXPECT_EQ(third["frames_left_out"], kFrames - 14);
  EXPECT_GT(recall(third), 0.7) << "the first of 14 frames are before it is known";
  EXPECT_EQ(recall(third), report["objects"]["recall"].get<double>());
  EXPECT_EQ(third["frames_untold"], 0);
  fs::remove(fs::path(options.out) / "report.json");
  EXPECT_EQ(evaluated(options)["frames_untold"], 26) << "of the first 40, 14 have a pose";
  fs::remove(fs::path(options.out) / "trajectory.tum");
  EXPECT_THAT(startupErrorOf([&] { evaluateObjects(options); }), HasSubstr("--trajectory takes"));
}

TEST(Pipeline, FramesThatItsRecordingLeftOutAreNoMisses) {
  const auto street = makeStreet("left_out_recorded");
  labelStreet(street);
  auto options = streetOptions(street, "first");
  options.image_size = {1242, 375};
  options.from = 0.6;
  options.every = 3;
  options.record = true;
  runPipeline(options);
  auto again = options;
  again.data = (street / "first/run.mcap").string();
  again.odometry = again.detections = "recorded";
  again.from = 0.0, again.every = 1;
  again.record = false;
  again.out = (street / "second").string();
  runPipeline(again);
  again.data = street.string();
  EXPECT_EQ(evaluated(again), evaluated(options));
  const auto report = nlohmann::json::parse(readText(street / "second/report.json"));
  EXPECT_EQ(report["frames"]["runs"].dump(), "[[6,57,3]]") << "not their numbers in the recording";
}

TEST(Pipeline, FramesWithoutAPoseAreCountedAndLeaveNoLine) {
  const auto street = makeStreet("few_poses");
  std::string tum;
  for (int frame = 0; frame < 20; ++frame) {
    tum += std::to_string(0.1 * frame) + " " + std::to_string(0.4 * frame) + " 0 0 0 0 0 1\n";
  }
  writeText(street / "poses.tum", tum);
  writeText(street / "label_02/0000.txt",
            "29 3 Car 0 0 -1.5 10 20 60 70 1.5 1.6 4.0 1.0 1.65 10.0 -1.57\n");
  auto options = streetOptions(street, "out");
  options.odometry = (street / "poses.tum").string();
  Pipeline pipeline(options);
  pipeline.run([](const PipelineCounts&) {});
  EXPECT_EQ(pipeline.counts().frames, 30U) << "the labels end at frame 29";
  EXPECT_EQ(pipeline.counts().odometry, 20U);
  EXPECT_EQ(pipeline.reasons().at("pipeline").of("frame_without_pose"), 10U);
}

TEST(Pipeline, WhatCannotStartSaysTheFix) {
  const auto street = makeStreet("errors");
  auto options = streetOptions(street, "out");
  options.detections = "simulated";
  EXPECT_THAT(errorOf(options), HasSubstr("needs a simulated folder"));
  options = streetOptions(street, "out");
  options.detections = "model";
  EXPECT_THAT(errorOf(options), HasSubstr("--model FILE.onnx"));
  options.model = "net.onnx";
  EXPECT_THAT(errorOf(options), HasSubstr("no images (image_02)"));
  options = streetOptions(street, "out");
  options.odometry = "truth";
  EXPECT_THAT(errorOf(options), HasSubstr("number of frames is known"));
  options.odometry = "vio";
  options.image_size = {1242, 375};
  writeText(street / "label_02/0000.txt", "9 -1 DontCare -1 -1 0 1 2 3 4 -1 -1 -1 0 0 0 0\n");
  EXPECT_THAT(errorOf(options), HasSubstr("no inertial samples"));
  options = streetOptions(street, "out");
  options.assignments = {"planner.speed=3"};
  EXPECT_THAT(
      errorOf(options),
      HasSubstr("services are vio, semantic_filter, inference, map_store, detector, drifting"));
  options.assignments = {"semantic_filter.no_such_key=3"};
  EXPECT_THAT(errorOf(options), HasSubstr("no_such_key"));
  options = streetOptions(street, "out");
  options.data = (street / "nowhere").string();
  EXPECT_THAT(errorOf(options), HasSubstr("the dataset folder is missing"));
}

TEST(Pipeline, ANetworkFileThatIsNoneIsRefusedWithASentence) {
  const auto root = replay::tinyEuroc("no_network");
  writeText(root / "net.onnx", "this is no network");
  PipelineOptions options;
  options.data = root.string();
  options.odometry = "truth";
  options.detections = "model";
  options.model = (root / "net.onnx").string();
  options.out = (root / "out").string();
  EXPECT_THAT(errorOf(options), HasSubstr("net.onnx"));
}

/// Draws images of the street: discs of different greys on both sides of the road.
void drawStreet(const fs::path& street) {
  auto calibration = replay::readTrackingCalibration(street / "calib/0000.txt");
  calibration.width = 1242, calibration.height = 375;
  const CameraModel camera(calibration.camera("cam0"));
  fs::create_directories(street / "image_02/0000");
  for (int frame = 0; frame < kFrames; ++frame) {
    const RigidTransform T_CW = (poseOf(frame) * camera.T_BC()).inverse();
    cv::Mat image(375, 1242, CV_8UC1, cv::Scalar(90));
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector3d point(0.15 * i, (i % 2 ? 1.0 : -1.0) * (4.0 + i * 7 % 5),
                                  -1.0 + 0.5 * (i * 13 % 9));
      const auto pixel = camera.project(T_CW * point);
      if (!pixel || !camera.inImage(*pixel, 12.0)) continue;
      cv::circle(image, cv::Point(cvRound(16 * pixel->x()), cvRound(16 * pixel->y())),
                 (4 + i % 4) * 16, cv::Scalar(i % 2 ? 130 + i * 37 % 120 : i * 53 % 60), cv::FILLED,
                 cv::LINE_AA, 4);
    }
    char name[16];
    std::snprintf(name, sizeof name, "%06d.png", frame);
    cv::imwrite((street / "image_02/0000" / name).string(), image);
  }
}

TEST(Pipeline, GivenPosesHaveLandmarksToo) {
  const fs::path street = makeStreet("landmarks");
  PipelineOptions options = streetOptions(street, "out");
  options.landmarks = true;
  EXPECT_THAT(errorOf(options), HasSubstr("has no images"));
  drawStreet(street);
  options.odometry = "vio";
  EXPECT_THAT(errorOf(options), HasSubstr("vio makes its own: leave --landmarks away"));
  options.odometry = options.detections = "recorded";
  EXPECT_THAT(errorOf(options),
              ::testing::AllOf(HasSubstr("leave --landmarks away"), HasSubstr("pose file")));
  options.detections = (street / "boxes.csv").string();
  options.odometry = (street / "poses.txt").string();
  options.record = true;
  runPipeline(options);
  std::size_t frames = 0, points = 0;
  replay::RecordedMessages recorded(street / "out/run.mcap");
  recorded.rewind([](const std::string& topic) { return topic == "landmarks"; });
  while (const auto message = recorded.next()) {
    const auto landmarks = replay::valueOf<Landmarks>(*message);
    ASSERT_TRUE(landmarks.has_value());
    ++frames;
    points = landmarks->landmarks.size();
    for (const Landmark& l : landmarks->landmarks) {
      EXPECT_LT(std::abs(std::abs(l.p_W.y()) - 6.0), 4.0) << l.p_W.transpose();
    }
  }
  EXPECT_EQ(frames, static_cast<std::size_t>(kFrames));
  EXPECT_GT(points, 10u);
}

TEST(Pipeline, ASecondCameraThatStopsTakesNoLandmarks) {
  const auto root = replay::tinyEuroc("pipeline_second_stops", true);
  replay::writeText(root / "mav0/state_groundtruth_estimate0/data.csv",
                    "#timestamp, p, q w x y z, v, b_w, b_a\n"
                    "990000000,1,2,3,1,0,0,0,0,0,0,0,0,0,0,0,0\n"
                    "1290000000,2,2,3,1,0,0,0,0,0,0,0,0,0,0,0,0\n");
  for (const char* image : {"1050000000", "1100000000", "1150000000", "1200000000"}) {
    fs::remove(root / "mav0/cam1/data" / (std::string(image) + ".png"));
  }
  PipelineOptions options;
  options.data = root.string();
  options.odometry = "truth";
  options.detections = "none";
  options.landmarks = options.record = true;
  options.out = (root / "out").string();
  runPipeline(options);
  std::size_t landmarks = 0;
  replay::RecordedMessages recorded(root / "out/run.mcap");
  recorded.rewind([](const std::string& topic) { return topic == "landmarks"; });
  while (recorded.next()) ++landmarks;
  EXPECT_EQ(landmarks, 5u);
}

TEST(Pipeline, ATruncatedImageCostsOneFrame) {
  const auto root = replay::tinyEuroc("pipeline_truncated");
  replay::truncate(root / "mav0/cam0/data/1050000000.png", 0.5);
  PipelineOptions options;
  options.data = root.string();
  options.odometry = "vio";
  options.detections = "none";
  options.out = (root / "out").string();
  Pipeline pipeline(options);
  pipeline.run([](const PipelineCounts&) {});
  pipeline.finish();
  EXPECT_EQ(pipeline.counts().frames, 4U);
  EXPECT_EQ(pipeline.reasons().at("capture").of("image_truncated"), 1U);
  const auto report = makeReport(pipeline, options);
  EXPECT_EQ(report["services"]["capture"]["dropped"], 1);
}

TEST(Pipeline, RecordedOdometryAndDetectionsGoTogetherAndComeFromARecording) {
  const fs::path street = makeStreet("recorded_refusals");
  PipelineOptions options;
  options.data = street;
  options.sequence = "0000";
  options.out = street / "out";
  options.odometry = "recorded";
  options.detections = "none";
  EXPECT_THAT(startupErrorOf([&] { Pipeline pipeline(options); }), HasSubstr("go together"));
  options.detections = "recorded";
  EXPECT_THAT(startupErrorOf([&] { Pipeline pipeline(options); }), HasSubstr("is no recording"));
}

TEST(Pipeline, ARecordedRunGivesTheFilterTheSameAgain) {
  const fs::path street = makeStreet("recorded_run");
  PipelineOptions options;
  options.data = street;
  options.sequence = "0000";
  options.out = street / "first";
  options.odometry = street / "poses.txt";
  options.detections = street / "boxes.csv";
  options.image_size = {1242, 375};
  options.record = options.quiet = true;
  const auto run = [&] {
    Pipeline pipeline(options);
    pipeline.run([](const PipelineCounts&) {});
    pipeline.finish();
  };
  run();
  options.data = street / "first" / "run.mcap";
  options.out = street / "second";
  options.odometry = options.detections = "recorded";
  run();
  // Its own recording also contains the messages that it received.
  options.data = street / "second" / "run.mcap";
  options.out = street / "third";
  options.record = false;
  run();
  // Rows begin with the name of the data, which differs.
  const auto rows = [&](const std::string& folder) {
    std::vector<std::string> lines;
    std::istringstream text(readText(street / folder / "objects_inst.csv"));
    for (std::string line; std::getline(text, line);) lines.push_back(line.substr(line.find(',')));
    return lines;
  };
  EXPECT_GT(rows("first").size(), 30u);
  EXPECT_EQ(rows("first"), rows("second"));
  EXPECT_EQ(rows("first"), rows("third"));
  EXPECT_EQ(readText(street / "first" / "events.jsonl"),
            readText(street / "second" / "events.jsonl"));
}

}  // namespace
}  // namespace perdure::tools
