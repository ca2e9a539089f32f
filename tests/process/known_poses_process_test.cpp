// Tests perdure-vio as a process with poses from another program. It publishes landmarks and no
// odometry, and reports missing inputs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "common/bus/endpoint.h"
#include "common/bus/topics.h"
#include "tests/process/support.h"
#include "tests/services/vio/drawn_drive.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

vio::test::DriveOptions manyPoints() {
  vio::test::DriveOptions options;
  options.points = 400;
  return options;
}

class KnownPosesProcess : public ::testing::Test {
 protected:
  KnownPosesProcess()
      : vio_({(programs() / "perdure-vio").string(), "--set", "input.odometry=given"},
             folder_.file("log")) {
    Calibration calibration;
    calibration.source = 1;
    calibration.cameras = {drive_.cameras()[0].calibration()};
    EXPECT_TRUE(calibrations_.write(calibration).has_value());
    EXPECT_TRUE(eventually(10s, [&] {
      return frames_.matched() > 0 && odometry_.matched() > 0 && landmarks_.matched() > 0;
    })) << vio_.log();
  }
  void give(std::uint64_t frame, bool with_pose) {
    const double t = 0.05 * static_cast<double>(frame);
    EXPECT_TRUE(frames_.write(vio::test::drawn(drive_, t, frame)).has_value());
    if (!with_pose) return;
    Odometry o;
    o.stamp = {1, frame, drive_.time(t), 0};
    o.world = {9, 0};
    o.state = OdometryState::kTracking;
    o.T_WB = drive_.truth(t).T_WB();
    o.covariance = 1e-6 * Matrix9d::Identity();
    EXPECT_TRUE(odometry_.write(o).has_value());
  }
  /// Returns the latest Health of vio.
  std::optional<Health> health() {
    health_reader_.drain([&](const Health& h) {
      if (h.process == "vio") health_ = h;
    });
    return health_;
  }

  bus::Domain domain_{ownNetwork()};
  bus::Participant participant_{domain_, "test"};
  bus::Writer<Calibration> calibrations_{participant_, bus::kTopic<Calibration>};
  bus::Writer<Frame> frames_{participant_, bus::frameTopic("cam0")};
  bus::Writer<Odometry> odometry_{participant_, bus::kTopic<Odometry>};
  bus::Reader<Landmarks> landmarks_{participant_, bus::kTopic<Landmarks>};
  bus::Reader<Health> health_reader_{participant_, bus::kTopic<Health>};
  std::optional<Health> health_;
  Folder folder_;
  vio::test::SimulatedDrive drive_{manyPoints()};
  Child vio_;
};

TEST_F(KnownPosesProcess, GivesLandmarksAndSaysWhenPosesStop) {
  std::map<std::uint64_t, std::size_t> points;
  const auto heard = [&](std::uint64_t frame) {
    landmarks_.drain([&](const Landmarks& m) { points[m.stamp.sequence] = m.landmarks.size(); });
    return points.contains(frame);
  };
  // Messages sent before all readers are matched are lost.
  std::uint64_t first = 0;
  ASSERT_TRUE(eventually(20s, [&] {
    give(first++, true);
    heard(first);
    return !points.empty();
  })) << vio_.log();
  for (std::uint64_t frame = first; frame < first + 40; ++frame) {
    give(frame, true);
    ASSERT_TRUE(eventually(10s, [&] { return heard(frame); })) << frame << "\n" << vio_.log();
  }
  std::size_t most = 0;  // the number depends on the position in the drive
  for (const auto& [frame, n] : points) most = std::max(most, n);
  EXPECT_GT(most, 20u);
  EXPECT_TRUE(eventually(5s, [&] { return health() && health()->state == HealthState::kOk; }));
  std::uint64_t next = first + 40;
  EXPECT_TRUE(eventually(20s, [&] {
    give(next++, false);
    return health()->state == HealthState::kDegraded;
  }));
  EXPECT_THAT(health()->message, HasSubstr("odometry")) << vio_.log();
  EXPECT_FALSE(heard(first + 40));
}

TEST_F(KnownPosesProcess, ImagesThatCannotBeDecodedAreNoFrames) {
  std::uint64_t frame = 0;
  ASSERT_TRUE(eventually(10s, [&] {
    give(frame++, true);
    return health() && health()->state == HealthState::kOk;
  })) << vio_.log();
  EXPECT_TRUE(eventually(20s, [&] {
    Frame broken = vio::test::drawn(drive_, 0.05 * static_cast<double>(frame), frame);
    broken.encoding = ImageEncoding::kJpegMono8;
    broken.data = std::make_shared<const std::vector<std::uint8_t>>(1000, std::uint8_t{7});
    EXPECT_TRUE(frames_.write(broken).has_value());
    ++frame;
    return health()->state == HealthState::kDegraded;
  })) << vio_.log();
  EXPECT_THAT(health()->message, HasSubstr("frames")) << vio_.log();
}

}  // namespace
}  // namespace perdure::test
