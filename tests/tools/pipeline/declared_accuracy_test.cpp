// The accuracy that a user declares of a pose file: a walk, or the covariance of each step.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/errors.h"
#include "services/map_store/core/map_database.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tools/pipeline/pipeline.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::writeText;
using testing::AllOf;
using testing::HasSubstr;

PipelineOptions tinyOptionsFor(const std::string& name) {
  PipelineOptions options;
  options.data = replay::tinyEuroc(name).string();
  options.detections = "none";
  options.out = (fs::path(options.data) / "out").string();
  return options;
}

/// Sixteen metres along x in four steps, with `columns` behind each pose.
std::string posesWith(const std::string& header, const std::string& columns) {
  std::string text = header;
  for (int i = 0; i < 5; ++i) {
    text += std::to_string(1.0 + 0.05 * i) + " " + std::to_string(4 * i) + " 0 0 0 0 0 1 " +
            columns + "\n";
  }
  return text;
}

/// Message and status of a start; "" and 0 if nothing is refused.
std::pair<std::string, int> startOf(const PipelineOptions& options) {
  try {
    Pipeline pipeline(options);
  } catch (const StartupError& error) {
    return {error.what(), static_cast<int>(error.code())};
  }
  return {};
}

/// Covariance of the increment to the second anchor, [x y z yaw].
Eigen::Matrix4d incrementAfter(const PipelineOptions& options) {
  {
    Pipeline pipeline(options);
    pipeline.run([](const PipelineCounts&) {});
    pipeline.finish();
  }
  const auto connection = map_store::openStoreForReading(fs::path(options.out) / "map.sqlite");
  const auto graph = map_store::MapReader(&connection).graph();
  if (!graph || graph->map.anchors.size() < 2) return Eigen::Matrix4d::Zero();
  return std::next(graph->map.anchors.begin())->second.anchor.from_previous.covariance;
}

TEST(DeclaredAccuracy, IsThatOfTheGraphByAWalkOrBySteps) {
  auto options = tinyOptionsFor("declared");
  options.odometry = (fs::path(options.data) / "poses.tum").string();
  constexpr double kWalk = 0.01, kYaw = 0.0005;
  writeText(options.odometry, posesWith("", ""));
  options.odometry_walk = "0.01,0.0005";
  const Eigen::Matrix4d by_walk = incrementAfter(options);
  EXPECT_NEAR(by_walk(0, 0), 12.0 * kWalk * kWalk, 1e-6);
  EXPECT_NEAR(by_walk(3, 3), 12.0 * kYaw * kYaw, 1e-9);
  options.odometry_walk.clear();
  const std::string p = std::to_string(4.0 * kWalk * kWalk) + " ";
  writeText(options.odometry,
            posesWith("# t x y z qx qy qz qw step_x_x step_y_y step_z_z step_rx_rx step_ry_ry "
                      "step_rz_rz\n",
                      p + p + p + "0 0 " + std::to_string(4.0 * kYaw * kYaw)));
  const Eigen::Matrix4d by_steps = incrementAfter(options);
  EXPECT_NEAR(by_steps(0, 0), by_walk(0, 0), 1e-6);
  EXPECT_NEAR(by_steps(3, 3), by_walk(3, 3), 1e-9);
  EXPECT_NEAR(by_steps(1, 3), by_walk(1, 3), 1e-9) << "the error of yaw turns what follows";
  EXPECT_GT(by_steps(1, 3), 1e-6);
}

TEST(DeclaredAccuracy, AWalkIsForPosesWithoutAnAccuracyOnly) {
  auto options = tinyOptionsFor("walk_refused");
  options.odometry_walk = ".001,.00001";
  for (const auto& [odometry, cause] : {std::pair{"vio", "computes its covariance"},
                                        {"truth", "is exact"},
                                        {"drifting", "declares"}}) {
    options.odometry = odometry;
    EXPECT_THAT(startOf(options), testing::Pair(AllOf(HasSubstr(cause), HasSubstr("leave")), 64));
  }
  options.odometry = (fs::path(options.data) / "poses.tum").string();
  writeText(options.odometry, posesWith("", ""));
  EXPECT_EQ(Pipeline(options).findings().size(), 0U);
  options.odometry_walk = "0.001";
  EXPECT_THAT(startOf(options), testing::Pair(HasSubstr("write POSITION,YAW in m/√m"), 64));
  options.odometry_walk = "0.001,fast";
  EXPECT_THAT(startOf(options), testing::Pair(HasSubstr("--odometry-walk: graph.walk_yaw"), 78));
  options.odometry_walk = "0.001,7";
  EXPECT_THAT(startOf(options), testing::Pair(AllOf(HasSubstr("--odometry-walk: graph.walk_yaw"),
                                                    HasSubstr("0.1 rad/√m")),
                                              78));
  options.odometry_walk = ".001,.00001";
  options.assignments = {"map_store.graph.walk_yaw=0.001"};
  EXPECT_THAT(startOf(options), testing::Pair(HasSubstr("give one of them"), 64));
  options.assignments.clear();
  writeText(options.odometry,
            "# t x y z qx qy qz qw step_x_x step_y_y step_z_z step_rx_rx step_ry_ry step_rz_rz\n"
            "1 0 0 0 0 0 0 1 1 1 1 1 1 1\n");
  EXPECT_THAT(startOf(options),
              testing::Pair(HasSubstr("poses.tum has the covariance of each step"), 64));
}

}  // namespace
}  // namespace perdure::tools
