#include "tools/calibrate/estimate/intrinsics.h"

#include <gtest/gtest.h>

#include "tools/calibrate/simulated.h"

namespace perdure::calibrate {
namespace {

SimulatedOptions optionsOf(const char* board, DistortionModel lens, std::uint64_t seed) {
  SimulatedOptions options;
  options.board = Board::parse(board);
  options.lens = lens;
  options.seed = seed;
  options.rate_hz = 5.0;
  return options;
}

CameraCalibration sizeOf(const SimulatedCalibration& simulated) {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = simulated.truth().width, camera.height = simulated.truth().height;
  return camera;
}

/// Checks that focal lengths and principal point are within 0.2 % of the focal length, and every
/// coefficient within four stated standard deviations.
void expectTruth(const char* board, DistortionModel lens) {
  double nees = 0.0;
  for (const std::uint64_t seed : {1, 2}) {
    const auto simulated = simulateCalibration(optionsOf(board, lens, seed));
    const auto found = estimateIntrinsics(simulated.options.board, simulateViews(simulated, 0.1),
                                          sizeOf(simulated), {lens, 60});
    ASSERT_TRUE(found) << found.error().detail;
    const Vector8d error = lensOf(found->camera) - lensOf(simulated.truth());
    const double focal = simulated.truth().fx;
    EXPECT_LT(error.head<4>().cwiseAbs().maxCoeff(), 0.002 * focal) << "seed " << seed;
    EXPECT_NEAR(found->sigma_px, 0.1, 0.005) << "seed " << seed;
    const Vector8d sigma = found->covariance.diagonal().cwiseSqrt();
    EXPECT_LT(error.cwiseAbs().cwiseQuotient(sigma).maxCoeff(), 4.0) << "seed " << seed << "\n"
                                                                     << error.transpose() << "\n"
                                                                     << sigma.transpose();
    nees += error.dot(found->covariance.inverse() * error) / 2.0;
  }
  EXPECT_GT(nees, 1.97);  // mean of two runs with 8 degrees of freedom each: 0.1 % … 99.9 %
  EXPECT_LT(nees, 19.6);
}

TEST(Intrinsics, OfChessboardMeetTheTruthWithinTheirStatedErrors) {
  expectTruth("chessboard:9x6:0.05", DistortionModel::kRadialTangential);
}
TEST(Intrinsics, OfAprilGridMeetTheTruthWithinTheirStatedErrors) {
  expectTruth("aprilgrid:6x6:0.088", DistortionModel::kRadialTangential);
}
TEST(Intrinsics, OfAFisheyeMeetTheTruthWithinTheirStatedErrors) {
  expectTruth("aprilgrid:6x6:0.088", DistortionModel::kEquidistant);
}

TEST(Intrinsics, OneCornerInFiftyMayBeElsewhere) {
  const auto simulated =
      simulateCalibration(optionsOf("aprilgrid:6x6:0.088", DistortionModel::kRadialTangential, 4));
  auto views = simulateViews(simulated, 0.1);
  std::size_t count = 0;
  for (View& view : views) {
    for (Corner& corner : view.corners) {
      if (++count % 50 == 0) corner.pixel += Eigen::Vector2d(7.0, -4.0);
    }
  }
  const auto found = estimateIntrinsics(simulated.options.board, views, sizeOf(simulated),
                                        {DistortionModel::kRadialTangential, 60});
  ASSERT_TRUE(found) << found.error().detail;
  EXPECT_NEAR(found->camera.fx, simulated.truth().fx, 0.002 * simulated.truth().fx);
  EXPECT_NEAR(found->sigma_px, 0.1, 0.005);
  const auto corners = static_cast<double>(found->corners + found->outliers);
  EXPECT_NEAR(static_cast<double>(found->outliers) / corners, 0.02, 0.003);
}

TEST(Intrinsics, TooFewViewsSayHowManyToTake) {
  const auto simulated =
      simulateCalibration(optionsOf("aprilgrid:6x6:0.088", DistortionModel::kRadialTangential, 1));
  auto views = simulateViews(simulated, 0.1);
  views.resize(3);
  const auto found = estimateIntrinsics(simulated.options.board, views, sizeOf(simulated), {});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, "calibrate_few_views");
  EXPECT_NE(found.error().detail.find("20 pictures"), std::string::npos);
}

TEST(Intrinsics, ViewsFromOneSideAreNotBelieved) {
  const auto simulated =
      simulateCalibration(optionsOf("aprilgrid:6x6:0.088", DistortionModel::kRadialTangential, 1));
  const auto views = simulateViews(simulated, 0.1);
  const std::vector<View> same(12, views[5]);
  const auto found = estimateIntrinsics(simulated.options.board, same, sizeOf(simulated),
                                        {DistortionModel::kRadialTangential, 60});
  // The estimate must either fail, or state a large error.
  if (found) {
    EXPECT_GT(std::sqrt(found->covariance(0, 0)), 0.002 * simulated.truth().fx);
  }
}

}  // namespace
}  // namespace perdure::calibrate
