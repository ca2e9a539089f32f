// A camera that turns on its mount in mid-drive: vio estimates its new pose, and the filter
// projects with it.
#include <gtest/gtest.h>

#include "common/math/so3.h"
#include "services/vio/cameras.h"
#include "tests/services/semantic_filter/scene.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::semantic_filter {
namespace {

using Eigen::Vector3d;
using testing::Harness;
using testing::TrueObject;

// Cars are detected after the turn, during one round in which the camera looks at all of them.
constexpr double kTurn_s = 12.025, kDetected_s = 13.0, kUntil_s = 26.0;

std::vector<TrueObject> cars() {
  std::vector<TrueObject> all;
  for (int i = 0; i < 8; ++i) {
    const double angle = 0.25 * M_PI * i, r = 13.0;
    all.push_back({testing::makeState(r * std::cos(angle), r * std::sin(angle), -0.5, 0.3 * i, 4.2,
                                      1.75, 1.5),
                   "car"});
  }
  return all;
}

Odometry odometryOf(const FrameStamp& stamp, const vio::FrameEstimate& e) {
  Odometry o = testing::odometryAt(stamp.sequence, e.nav.T_WB());
  o.stamp = stamp;
  o.v_WB = e.nav.v_WB;
  o.covariance = e.covariance;
  o.has_increment = e.has_increment;
  o.increment_from = e.increment_from;
  o.transition = e.transition;
  o.increment_covariance = e.increment_covariance;
  return o;
}

/// RMS error of the objects' positions across the line of sight from the centre of the path,
/// relative to the body.
double rmsError(const Objects& found, const RigidTransform& T_WB) {
  double squares = 0.0;
  int count = 0;
  for (const ObjectBelief& object : found.objects) {
    if (!object.confirmed) continue;
    const Vector3d place = T_WB * (found.T_WB.inverse() * object.best().mean.head<3>());
    double nearest = 3.0;
    for (const TrueObject& car : cars()) {
      const Vector3d truth = car.x.head<3>();
      nearest = std::min(nearest, truth.normalized().cross(place - truth).norm());
    }
    squares += nearest * nearest, ++count;
  }
  EXPECT_GE(count, 6);
  return std::sqrt(squares / count);
}

struct Drive {
  int published = 0;
  double error_m = 0.0;  ///< at the end
};

/// Drives with a camera that turns by `turn`; the filter receives vio's estimates if `informed`.
Drive drive(const Vector3d& turn, bool informed) {
  vio::test::DriveOptions options;
  options.mount.q = expQuaternion(turn);
  options.mount_from_s = kTurn_s;
  vio::test::SimulatedDrive world(options);
  vio::ImuBuffer imu;
  for (const auto& reading : world.imu(kUntil_s + 1.0)) EXPECT_TRUE(imu.add(reading));
  vio::Estimator estimator({}, world.T_BC(), 0.0);
  estimator.start(vio::test::startAt(world, 0.2, 1, 1.0));
  const Calibration given = testing::calibrationOf(world.cameras()[0].calibration());
  vio::CameraNews news;
  news.begin(given);
  Harness h;
  h.node.onCalibration(given);
  std::mt19937 random(7);
  Drive result;
  std::uint64_t k = 0;
  double t = 0.2;
  while (t + 0.05 < kUntil_s) {
    t += 0.05;
    const auto estimate = estimator.process({++k, world.time(t), world.see(t), {}, {}}, imu);
    EXPECT_TRUE(estimate);
    if (!estimate) return result;
    if (const auto cameras = news.take(estimator, world.cameras())) {
      ++result.published;
      if (informed) h.node.onCalibration(*cameras);
    }
    if (t < kDetected_s) continue;
    Detections detections = testing::detectionsAt(k, {});
    detections.stamp.time = world.time(t);
    const View view{.camera = &world.cameras()[0], .T_WB = world.seenFrom(t)};
    for (const TrueObject& car : cars()) {
      const auto box = testing::detect(car, view, BoxParameters{}, 0.3, 3.0, random);
      if (box) detections.detections.push_back(*box);
    }
    h.node.onOdometry(odometryOf(detections.stamp, *estimate));
    h.node.onDetections(detections);
  }
  result.error_m = rmsError(h.objects.back(), world.truth(t).T_WB());
  return result;
}

TEST(TurnedCamera, ObjectsArePlacedByThePoseOfTheCameraThatVioEstimates) {
  const Drive straight = drive(Vector3d::Zero(), true);
  EXPECT_EQ(straight.published, 0);
  for (const Vector3d& axis : {Vector3d(0, 0, 1), Vector3d(0, 1, 0)}) {
    const Vector3d turn = M_PI / 180.0 * axis;
    const Drive without = drive(turn, false), with = drive(turn, true);
    std::printf("%.3f m without a turn, %.3f m by the rig, %.3f m by vio's %d estimates\n",
                straight.error_m, without.error_m, with.error_m, with.published);
    EXPECT_GE(with.published, 1);
    EXPECT_LE(with.published, 10);
    EXPECT_LT(with.error_m, 0.5 * without.error_m);
    EXPECT_LT(with.error_m, 1.5 * straight.error_m + 0.02);
  }
}

}  // namespace
}  // namespace perdure::semantic_filter
