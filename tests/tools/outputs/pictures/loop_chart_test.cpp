#include "tools/outputs/pictures/loop_chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tools/outputs/pixels.h"
#include "tools/outputs/pictures/evolution_picture.h"

namespace perdure::tools {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::uint64_t kRunFrames = 100, kLoopFrame = 60;

TimePoint timeOf(std::uint64_t frame) {
  return fromNanoseconds(100'000'000 * static_cast<std::int64_t>(frame));
}

/// A drive along x. W drifts to the left by 0.1 m per frame; the map corrects the drift at frame
/// 60.
struct MovedRun {
  MovedRun() {
    for (std::uint64_t i = 0; i < kRunFrames; ++i) {
      const double x = static_cast<double>(i), drift = 0.1 * x;
      poses[i] = {timeOf(i), RigidTransform()};
      poses[i].T_WB.p = {x, drift, 0.0};
      truth.path[i] = {x, 0.0, 0.0};
      in_map.then[i] = {x, i < kLoopFrame ? drift : 0.2, 0.0};
      if (i % 10 == 0) {
        in_map.along.emplace_back(
            timeOf(i), RigidTransform(Eigen::Quaterniond::Identity(), {0.0, -drift, 0.0}));
      }
    }
  }
  BodyErrors errors(const PictureTruth* known) const {
    return bodyErrors(poses, in_map, {{kLoopFrame, EventKind::kLoopClosed}}, known);
  }
  std::map<std::uint64_t, replay::StampedPose> poses;
  DriveInMap in_map;
  PictureTruth truth;
};

TEST(LoopChart, TellsTheErrorInWThenOnTheMapAndInTheEnd) {
  const MovedRun run;
  const BodyErrors errors = run.errors(&run.truth);
  ASSERT_THAT(errors.points, SizeIs(kRunFrames));
  EXPECT_TRUE(errors.against_truth);
  EXPECT_NEAR(*errors.points[50].in_W, 5.0, 1e-9);
  EXPECT_NEAR(*errors.points[59].then, 5.9, 1e-9);
  EXPECT_NEAR(*errors.points[60].then, 0.2, 1e-9);
  EXPECT_NEAR(*errors.points[45].at_end, 0.0, 1e-9) << "between two anchors";
}

TEST(LoopChart, WithoutTruthItTellsHowFarTheMapMovedTheBody) {
  const MovedRun run;
  const BodyErrors errors = run.errors(nullptr);
  EXPECT_FALSE(errors.against_truth);
  EXPECT_NEAR(*errors.points[59].then, 0.0, 1e-9);
  EXPECT_NEAR(*errors.points[70].then, 6.8, 1e-9);
  EXPECT_FALSE(errors.points[70].in_W);
}

TEST(LoopChart, ErrorsAreThoseOfTheWaySinceTheSessionBegan) {
  MovedRun run;  // relocalised on an older map with another origin
  const RigidTransform T_MW(Eigen::Quaterniond::Identity(), {500.0, 40.0, 0.0});
  for (auto& [time, T] : run.in_map.along) T = T_MW * T;
  EXPECT_NEAR(*run.errors(&run.truth).points[80].at_end, 0.0, 1e-9);
}

TEST(LoopChart, WithoutALoopThereIsNone) {
  const MovedRun run;
  EXPECT_THAT(bodyErrors(run.poses, run.in_map, {}, &run.truth).points, IsEmpty());
  EXPECT_EQ(drawEvolutions({}).rows, drawEvolutions({}, BodyErrors{}).rows);
}

TEST(LoopChart, CurvesFallWhereTheLoopIsMarked) {
  const MovedRun run;
  const BodyErrors errors = run.errors(&run.truth);
  cv::Mat picture(200, 500, CV_8UC3, kPaper);
  const cv::Rect area(60, 40, 400, 120);
  drawBodyErrors(picture, area, errors, {0.0, 99.0});
  const Chart chart(picture, area, {0.0, 99.0}, {0.0, 1.08 * 9.9});
  const Colour loop(40, 150, 235), then(200, 119, 31);
  const cv::Point2d mark = chart.at(kLoopFrame, 1.08 * 9.9);
  EXPECT_TRUE(hasColour(picture, mark + cv::Point2d(0, -4), loop));
  EXPECT_FALSE(hasColour(picture, mark + cv::Point2d(40, -4), loop));
  EXPECT_TRUE(hasColour(picture, chart.at(80, 0.2), then, 2));
  EXPECT_FALSE(hasColour(picture, chart.at(80, 8.0), then, 2)) << "there it is W";
  EXPECT_GT(drawEvolutions({}, errors).rows, drawEvolutions({}).rows + 200);
}

}  // namespace
}  // namespace perdure::tools
