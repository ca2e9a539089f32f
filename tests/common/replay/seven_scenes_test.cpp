#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/replay/data_check.h"
#include "common/replay/dataset.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string errorOfScene(const DatasetOptions& options) {
  return startupErrorOf([&] { Dataset::open(options); });
}

double upOffDeg(const Dataset& dataset) {
  // The camera of frame 0 is the poses' frame; its up vector must become z in W.
  const RigidTransform T_WC =
      dataset.truth()->poses().front().T_WB * dataset.calibration().cameras.front().T_BC;
  const Eigen::Vector3d up_W = T_WC.q * tinySevenScenesUp();
  return std::acos(std::min(1.0, up_W.z())) * 180.0 / M_PI;
}

TEST(SevenScenes, BothLayoutsGiveFramesPosesAndAWorldThatStandsUpright) {
  for (const bool folders : {false, true}) {
    const auto dataset = Dataset::open({.path = tinySevenScenes("both", folders)});
    EXPECT_EQ(dataset->kind(), DatasetKind::kSevenScenes);
    EXPECT_EQ(dataset->frameCount(), 3U);
    EXPECT_FALSE(dataset->calibration().imu);
    std::size_t frames = 0;
    while (const auto message = dataset->next()) {
      const auto& frame = std::get<Frame>(*message);
      EXPECT_EQ(frame.width, 640U);
      EXPECT_NEAR(toSeconds(frame.stamp.time.time_since_epoch()), frames / 30.0, 1e-9);
      EXPECT_TRUE(dataset->truth()->at(frame.stamp.sequence, frame.stamp.time));
      ++frames;
    }
    EXPECT_EQ(frames, 3U);
    EXPECT_TRUE(dataset->reasons().all().empty());
    EXPECT_LT(upOffDeg(*dataset), 0.5);
    const auto& poses = dataset->truth()->poses();
    EXPECT_NEAR((poses[2].T_WB.p - poses[0].T_WB.p).norm(), 0.2, 1e-6);
  }
}

TEST(SevenScenes, ASequenceOfASceneIsNamed) {
  const fs::path scene = freshFolder("scene");
  fs::rename(tinySevenScenes("scene_part"), scene / "seq-03");
  EXPECT_THAT(errorOfScene({.path = scene}), HasSubstr("name one with --sequence (seq-03)"));
  EXPECT_EQ(Dataset::open({.path = scene, .sequence = "seq-03"})->frameCount(), 3U);
  EXPECT_EQ(Dataset::open({.path = scene / "seq-03" / ""})->frameCount(), 3U);
}

TEST(SevenScenes, GravityOfSensorYamlGoesBeforeThePlanes) {
  const fs::path folder = tinySevenScenes("given");
  const Eigen::Vector3d up = tinySevenScenesUp();
  const std::string text = "up: [" + std::to_string(up.x()) + ", " + std::to_string(up.y()) + ", " +
                           std::to_string(up.z()) + "]\n";
  writeText(folder / "sensor.yaml", text);
  const auto dataset = Dataset::open({.path = folder});
  EXPECT_LT(upOffDeg(*dataset), 1e-3);
  EXPECT_TRUE(dataset->recording().notes.empty());
  EXPECT_EQ(dataset->calibration().cameras.front().fx, 525.0);
  writeText(folder / "sensor.yaml", "up: [0, 0, 0]\n");
  EXPECT_THAT(errorOfScene({.path = folder}), HasSubstr("is no direction"));
  writeText(folder / "sensor.yaml", "up: [0, -1e200, 0]\n");  // the square of this number overflows
  EXPECT_NEAR(Dataset::open({.path = folder})->truth()->poses().front().T_WB.q.norm(), 1.0, 1e-9);
  writeText(folder / "sensor.yaml",
            text + "resolution: [640, 480]\nintrinsics: [500, 501, 310, 230]\n");
  EXPECT_EQ(Dataset::open({.path = folder})->calibration().cameras.front().fy, 501.0);
}

TEST(SevenScenes, WithoutDepthTheFixIsSaid) {
  const fs::path folder = tinySevenScenes("no_depth");
  for (const char* name : {"0", "1", "2"}) {
    fs::remove(folder / ("frame-00000" + std::string(name) + ".depth.png"));
  }
  EXPECT_THAT(errorOfScene({.path = folder}),
              HasSubstr("write sensor.yaml in the folder with up:"));
}

TEST(SevenScenes, APoseThatIsMissingOrLostIsCountedAndTheRestStays) {
  const fs::path folder = tinySevenScenes("lost");
  fs::remove(folder / "frame-000000.pose.txt");
  writeText(folder / "frame-000001.pose.txt",
            "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n");
  const auto dataset = Dataset::open({.path = folder});
  EXPECT_EQ(dataset->reasons().of("pose_missing"), 1U);
  EXPECT_EQ(dataset->reasons().of("pose_lost"), 1U);
  EXPECT_EQ(dataset->truth()->poses().size(), 1U);
}

TEST(SevenScenes, WrongPosesAndMissingPartsAreNamed) {
  const fs::path folder = tinySevenScenes("wrong");
  const fs::path pose = folder / "frame-000001.pose.txt";
  writeText(pose, "1 0 0 0\n0 1 0 0\n0 0 2 0\n0 0 0 1\n");
  EXPECT_THAT(errorOfScene({.path = folder}),
              HasSubstr("frame-000001.pose.txt: the rotation is not orthonormal"));
  writeText(pose, "1 0 0 0\n0 1 0 0\n0 0 1 0\n");
  EXPECT_THAT(errorOfScene({.path = folder}), HasSubstr("12 numbers, where a pose has 16"));
  writeText(pose, "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 1 1\n");
  EXPECT_THAT(errorOfScene({.path = folder}), HasSubstr("the last row"));
  writeText(pose, "1 0 0 0\n0 1 0 -1e308\n0 0 1 0\n0 0 0 1\n");
  EXPECT_THAT(errorOfScene({.path = folder}), HasSubstr("more than 1000 km away"));
  writeText(pose, "1 0 0 0\n0 1 0 x\n0 0 1 0\n0 0 0 1\n");
  EXPECT_THAT(errorOfScene({.path = folder}), HasSubstr("line 2 is not of numbers"));
  EXPECT_EQ(startupCodeOf([&] { Dataset::open({.path = folder}); }), ExitCode::kData);
  for (const char* name : {"0", "1", "2"}) {
    fs::remove(folder / ("frame-00000" + std::string(name) + ".pose.txt"));
  }
  EXPECT_THAT(errorOfScene({.path = folder}), HasSubstr("the pose of any frame is missing"));
  const fs::path empty = freshFolder("empty_scene");
  fs::create_directories(empty / "color");
  fs::create_directories(empty / "pose");
  EXPECT_THAT(errorOfScene({.path = empty}), HasSubstr("any colour image is missing"));
}

TEST(SevenScenes, ImagesOfAnotherSizeNeedALens) {
  const fs::path folder = tinySevenScenes("small");
  for (const char* name : {"0", "1", "2"}) {
    writeImage(folder / ("frame-00000" + std::string(name) + ".color.png"), 320, 240, 3);
  }
  EXPECT_THAT(errorOfScene({.path = folder}), HasSubstr("write sensor.yaml"));
}

}  // namespace
}  // namespace perdure::replay
