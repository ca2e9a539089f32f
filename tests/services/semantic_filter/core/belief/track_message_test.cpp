#include "services/semantic_filter/core/belief/track_message.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeObject;
using testing::makePriors;
using testing::makeState;

/// *Other* starts from one yaw, and its boxes reduce the variance of the yaw too early.
TEST(TrackMessage, TheYawOfOtherIsUnknownBeforeAModeSearch) {
  const auto sigmaYaw = [](const char* name, bool sought) {
    Track object = makeObject(1, name, makeState(10, 0, 0.7, 0.3, 1, 1, 1), 0.004);
    object.hypotheses[0].modes_searched = sought;
    return std::sqrt(toBelief(object, makePriors(), 0.7).best().covariance(kYaw, kYaw));
  };
  const double any = M_PI / std::sqrt(12.0);
  EXPECT_NEAR(sigmaYaw("other", false), any, 1e-9);
  EXPECT_LT(sigmaYaw("other", true), 0.5 * any);
  EXPECT_LT(sigmaYaw("car", false), 0.5 * any);
}

TEST(TrackMessage, ACovarianceThatRoundingMadeIndefiniteIsRepairedAndOthersAreNotChanged) {
  Track object = makeObject(1, "car", makeState(1, 2, 3, 0.1, 4, 1.8, 1.5), 0.04);
  Matrix7d P = object.hypotheses[0].P.topLeftCorner<7, 7>();
  EXPECT_EQ(toBelief(object, makePriors(), 0.7).best().covariance, P) << "to the bit";
  // Length and width differ only by rounding, far less than the position does.
  P.block<2, 2>(kSize, kSize).setConstant(1e-8);
  P(kSize + 1, kSize + 1) -= 1e-18;
  P(0, 0) = 1e4;
  object.hypotheses[0].P.topLeftCorner<7, 7>() = P;
  Eigen::LLT<Matrix7d> before(P);
  ASSERT_EQ(before.info(), Eigen::NumericalIssue);
  const Matrix7d repaired = toBelief(object, makePriors(), 0.7).best().covariance;
  EXPECT_EQ(Eigen::LLT<Matrix7d>(repaired).info(), Eigen::Success);
  EXPECT_EQ(repaired, repaired.transpose());
  const Vector7d sigma = P.diagonal().cwiseSqrt();
  const Matrix7d scaled = (repaired - P).cwiseQuotient(sigma * sigma.transpose());
  EXPECT_LT(scaled.cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace perdure::semantic_filter
