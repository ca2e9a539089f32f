// Tests the labels that a run's map gives to the frames of the run.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/common/replay/tiny_datasets.h"
#include "tools/model/labelled_frames.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kFrames = 5;
constexpr std::int64_t kFirst_ns = 1'000'000'000, kPeriod_ns = 50'000'000;

struct Thing {
  std::string class_name;
  double score;
  double x_px, y_px, depth, size_px;  ///< a cube: pixel and depth of its centre, size in the image
};

class MapLabels : public ::testing::Test {
 protected:
  /// Writes a run with the body at the origin and with these objects.
  void runFound(const std::vector<Thing>& things, std::int64_t later_ns = 0) {
    const auto dataset = replay::Dataset::open({.path = data_});
    const CameraModel camera(dataset->calibration().cameras.front());
    std::string rows =
        "sequence,frame,timestamp_ns,object_id,class,score,x,y,z,l,w,h,yaw,visible\n";
    std::string poses;
    for (int i = 0; i < kFrames; ++i) {
      const std::int64_t time = kFirst_ns + later_ns + i * kPeriod_ns;
      poses += fmt::format("{:.2f} 0 0 0 0 0 0 1\n", static_cast<double>(time) * 1e-9);
      int id = 0;
      for (const Thing& t : things) {
        const auto ray = camera.unproject({t.x_px, t.y_px});
        const Eigen::Vector3d p_C = t.depth * ray.value().homogeneous();
        const Eigen::Vector3d p = camera.T_BC() * p_C;
        const double size = t.size_px / camera.fx() * t.depth;
        rows += fmt::format("tiny,{},{},{},{},{},{},{},{},{},{},{},0,1\n", i, time, ++id,
                            t.class_name, t.score, p.x(), p.y(), p.z(), size, size, size);
      }
    }
    replay::writeText(out_ / "objects_final.csv", rows);
    replay::writeText(out_ / "trajectory.tum", poses);
  }
  LabelledData read(std::uint64_t every = 1) const {
    return readLabelled({data_, "", out_, every}, replay::ClassAliases{}, 2.0);
  }

  const fs::path data_ = replay::tinyEuroc("map_labels_data");
  const fs::path out_ = replay::freshFolder("map_labels_out");
};

const std::vector<Thing> kFour{{"car", 0.99, 6, 6, 40, 3},
                               {"car", 0.99, 26, 6, 40, 3},
                               {"car", 0.99, 6, 18, 40, 3},
                               {"car", 0.99, 26, 18, 40, 3}};

TEST_F(MapLabels, ExpectsWhatTheMapHoldsInEachFrame) {
  runFound(kFour);
  const LabelledData data = read();
  EXPECT_EQ(data.judged, std::set<std::string>{"car"});
  EXPECT_FALSE(data.sides_known);
  ASSERT_EQ(data.frames.size(), 5u);
  for (const LabelledFrame& frame : data.frames) {
    ASSERT_EQ(frame.boxes.size(), 8u) << "each with what is beside it";
    for (std::size_t i = 0; i < 4; ++i) {
      const TrueBox &box = frame.boxes[2 * i], &beside = frame.boxes[2 * i + 1];
      EXPECT_FALSE(box.ignored);
      EXPECT_EQ(box.class_name, "car");
      EXPECT_NEAR(box.box.x1 / 2 + box.box.x2 / 2, kFour[i].x_px, 0.5);
      EXPECT_NEAR(box.box.y1 / 2 + box.box.y2 / 2, kFour[i].y_px, 0.5);
      EXPECT_TRUE(beside.ignored) << "boxes there are neither right nor clutter";
      EXPECT_NEAR(beside.box.width(), 1.5 * box.box.width(), 1e-9);
    }
  }
}

TEST_F(MapLabels, IgnoresWhatIsDoubtfulCutHiddenOrSmall) {
  auto things = kFour;
  things.push_back({"car", 0.6, 16, 12, 40, 3});      // uncertain
  things.push_back({"car", 0.99, 32, 12, 40, 3});     // cut by the border
  things.push_back({"car", 0.99, 6.3, 6, 50, 3});     // behind the first object
  things.push_back({"car", 0.99, 16, 20, 400, 1.5});  // small
  things.push_back({"dog", 0.99, 16, 4, 40, 2.5});    // the only one: too few views to be judged
  runFound(things);
  const LabelledData data = read();
  EXPECT_EQ(data.judged, std::set<std::string>{"car"});
  for (const LabelledFrame& frame : data.frames) {
    ASSERT_EQ(frame.boxes.size(), 18u);
    for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(frame.boxes[2 * i].ignored, i >= 4 && i < 8) << i;
  }
}

TEST_F(MapLabels, WhatIsSeenTooRarelyIsRefusedWithTheFix) {
  runFound({kFour[0], kFour[1], kFour[2]});
  EXPECT_THAT(replay::startupErrorOf([&] { (void)read(); }), HasSubstr("over a longer drive"));
  runFound(kFour);
  EXPECT_THAT(replay::startupErrorOf([&] { (void)read(2); }), HasSubstr("twenty frames"))
      << "of each second frame only";
  fs::remove(out_ / "objects_final.csv");
  EXPECT_THAT(replay::startupErrorOf([&] { (void)read(); }), HasSubstr("objects_final.csv"));
}

TEST_F(MapLabels, ARunOverAnotherDriveIsRefused) {
  runFound(kFour, 20'000'000);
  EXPECT_THAT(replay::startupErrorOf([&] { (void)read(); }), HasSubstr("is of another drive"));
}

}  // namespace
}  // namespace perdure::tools
