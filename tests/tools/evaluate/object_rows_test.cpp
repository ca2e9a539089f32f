#include "tools/evaluate/object_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/common/replay/tiny_datasets.h"

namespace perdure::tools {
namespace {

using ::testing::HasSubstr;

constexpr char kHeader[] =
    "sequence,frame,timestamp_ns,object_id,class,score,x,y,z,l,w,h,yaw,visible\n";

replay::StampedPose poseAt(std::int64_t ns, double x) {
  return {fromNanoseconds(ns), RigidTransform(Eigen::Quaterniond::Identity(), {x, 0, 0})};
}
EstimateRow rowOf(std::uint64_t frame, std::int64_t ns) {
  EstimateRow row;
  row.frame = frame;
  row.time = fromNanoseconds(ns);
  return row;
}

TEST(ObjectRows, AreReadBackAsTheyWereWritten) {
  const auto file = replay::freshFolder("rows") / "o.csv";
  replay::writeText(file,
                    std::string(kHeader) + "0000,3,300000000,12,Car,0.9,1,2,3,4,1.6,1.5,0.25,1\n");
  const auto rows = readObjectRows(file);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].frame, 3U);
  EXPECT_EQ(rows[0].id, 12U);
  EXPECT_EQ(rows[0].class_name, "car");
  EXPECT_EQ(rows[0].centre_W, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(rows[0].height, 1.5);
  EXPECT_EQ(rows[0].yaw, 0.25);
}

TEST(ObjectRows, WrongLinesAreLocated) {
  const auto file = replay::freshFolder("rows") / "o.csv";
  replay::writeText(file, std::string(kHeader) + "0,1,2\n0000,3,x,12,car,0.9,1,2,3,4,1,1,0,1\n");
  const auto error = replay::startupErrorOf([&] { readObjectRows(file); });
  EXPECT_THAT(error, HasSubstr("o.csv:2:"));
  EXPECT_THAT(error, HasSubstr("o.csv:3:"));
  EXPECT_EQ(replay::startupCodeOf([&] { readObjectRows(file); }), ExitCode::kData);
  replay::writeText(file, "frame,id\n");
  EXPECT_THAT(replay::startupErrorOf([&] { readObjectRows(file); }),
              HasSubstr("o.csv:1: the header"));
}

TEST(PosesByFrame, TenthsOfASecondFromZeroTieThemselves) {
  const auto poses = posesByFrame({poseAt(200'000'000, 2), poseAt(500'000'000, 5)}, {});
  EXPECT_EQ(poses.at(2).p.x(), 2.0);
  EXPECT_EQ(poses.at(5).p.x(), 5.0);
}

TEST(PosesByFrame, LinesOfARunOverEachThirdFrameAreThoseFrames) {
  std::vector<replay::StampedPose> poses;
  for (std::int64_t i = 0; i < 6; ++i) {
    poses.push_back(poseAt(1'000'000'000 + i * 300'000'001, static_cast<double>(i)));
  }
  const std::vector<EstimateRow> rows = {rowOf(6, toNanoseconds(poses[2].time))};
  const auto tied = posesByFrame(poses, rows, std::set<std::uint64_t>{0, 3, 6, 9, 12});
  ASSERT_EQ(tied.size(), 5U) << "the last line is of no used frame";
  for (const std::uint64_t i : {0U, 1U, 2U, 3U, 4U}) {
    EXPECT_EQ(tied.at(3 * i).p.x(), static_cast<double>(i));
  }
}

TEST(PosesByFrame, RowsTieTimesToFramesAndLinesBetweenAreConsecutive) {
  std::vector<replay::StampedPose> poses;
  for (int i = 0; i < 6; ++i) poses.push_back(poseAt(1'000'000'000 + i * 103'333'333, i));
  const auto tied = posesByFrame(poses, {rowOf(7, toNanoseconds(poses[2].time))});
  EXPECT_EQ(tied.at(5).p.x(), 0.0);
  EXPECT_EQ(tied.at(10).p.x(), 5.0);
}

TEST(PosesByFrame, AMissingLineBetweenTiedOnesIsPlacedByTime) {
  // Frames 0 1 3 4: the line of frame 2 is missing.
  std::vector<replay::StampedPose> poses;
  for (const int i : {0, 1, 3, 4}) poses.push_back(poseAt(1'000'000'007 + i * 103'000'000, i));
  const auto tied = posesByFrame(
      poses, {rowOf(0, toNanoseconds(poses[0].time)), rowOf(4, toNanoseconds(poses[3].time))});
  ASSERT_EQ(tied.size(), 4U);
  EXPECT_EQ(tied.at(1).p.x(), 1.0);
  EXPECT_EQ(tied.at(3).p.x(), 3.0);
}

}  // namespace
}  // namespace perdure::tools
