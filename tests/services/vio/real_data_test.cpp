// Tests the filter on real sensors if ../shared/data exists; otherwise the tests report that they
// are skipped.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/core/utility.hpp>

#include "common/replay/dataset.h"
#include "services/vio/node.h"

namespace perdure::vio {
namespace {

namespace fs = std::filesystem;

fs::path dataFolder() {
  const char* source = std::getenv("PERDURE_SOURCE");
  return fs::path(source ? source : ".") / ".." / "shared" / "data";
}

struct Played {
  std::vector<Odometry> odometry;
  TimePoint first_frame;
  double path_by_speed = 0.0;
};

Played play(const fs::path& folder) {
  cv::setNumThreads(1);
  replay::DatasetOptions options;
  options.path = folder;
  options.encoding = options.second_encoding = ImageEncoding::kMono8;
  const auto dataset = replay::Dataset::open(options);
  Played played;
  played.first_frame = *dataset->frameTime(0);
  Node node(Config{}, 3,
            {[&](const Odometry& o) {
               if (o.state != OdometryState::kInitialising) {
                 played.odometry.push_back(o);
               }
             },
             {}});
  node.onCalibration(dataset->calibration());
  std::optional<SpeedSample> before;
  while (const auto message = dataset->next()) {
    if (const auto* imu = std::get_if<ImuSample>(&*message)) node.onImu(*imu);
    if (const auto* frame = std::get_if<Frame>(&*message)) node.onFrame(*frame);
    if (const auto* speed = std::get_if<SpeedSample>(&*message)) {
      node.onSpeed(*speed);
      if (before) {
        played.path_by_speed +=
            0.5 * (speed->speed + before->speed) * toSeconds(speed->time - before->time);
      }
      before = *speed;
    }
  }
  node.flush();
  return played;
}

TEST(RealData, AVehicleAtRestIsKnownWithinASecondAndDoesNotDrift) {
  const fs::path folder = dataFolder() / "euroc_V101_static";
  if (!fs::exists(folder)) GTEST_SKIP() << "needs EuRoC V1_01 at rest in ../shared/data";
  const Played played = play(folder);
  ASSERT_GE(played.odometry.size(), 75u);
  EXPECT_LT(toSeconds(played.odometry.front().stamp.time - played.first_frame), 1.0);
  for (const Odometry& o : played.odometry) EXPECT_LT(o.T_WB.p.norm(), 0.05);
}

TEST(RealData, AStreetDriveWithTwoCamerasAndSpeedIsFollowedFromItsFirstFrames) {
  const fs::path folder = dataFolder() / "kitti_raw" / "2011_09_26" / "2011_09_26_drive_0005_sync";
  if (!fs::exists(folder)) GTEST_SKIP() << "needs KITTI's drive 0005 in ../shared/data";
  const Played played = play(folder);
  EXPECT_GE(played.odometry.size(), 150u);
  double path = 0.0;
  for (std::size_t i = 1; i < played.odometry.size(); ++i) {
    path += (played.odometry[i].T_WB.p - played.odometry[i - 1].T_WB.p).norm();
  }
  EXPECT_NEAR(path / played.path_by_speed, 1.0, 0.02);
}

}  // namespace
}  // namespace perdure::vio
