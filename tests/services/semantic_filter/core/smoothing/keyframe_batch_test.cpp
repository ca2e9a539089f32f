// Covariances between the pose errors of keyframes.
#include <gtest/gtest.h>

#include <random>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/smoothing/batch_problem.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

/// A pose error that walks while the body turns and moves. Has products of transitions, and
/// covariances at each keyframe, propagated from one keyframe to the next.
class Walk {
 public:
  Walk(unsigned seed, double shrinks) : random_(seed) {
    PoseError error;
    error.covariance = 1e-4 * Matrix6d::Identity();
    for (int k = 0; k < kLooks; ++k) {
      errors.push_back(error);
      const View view{&camera_, RigidTransform(), Eigen::Vector3d::UnitZ()};
      Keyframe look;
      look.from = std::make_shared<const FrameView>(view, error, fromNanoseconds(1000 * k),
                                                    std::make_shared<const BoxStyles>());
      keyframes.push_back(std::make_shared<const Keyframe>(look));
      J.push_back(PoseJacobian::NullaryExpr([&] { return normal_(random_); }));
      Matrix6d A = Matrix6d::Identity();
      A.topLeftCorner<3, 3>() = rotationAboutZ(0.3 * normal_(random_));
      A.bottomLeftCorner<3, 3>() = 0.2 * skew(Eigen::Vector3d(normal_(random_), 0.5, 0.1));
      A *= shrinks;  // an effect of odometry corrections
      error.product = (A * error.product).eval();
      error.covariance = (A * error.covariance * A.transpose()).eval();
      error.covariance.diagonal().array() += 1e-5;
    }
    now = error;
  }

  /// Covariance of keyframe i with an earlier j, from the individual transitions.
  Matrix6d covariance(std::size_t i, std::size_t j) const {
    return errors[i].product * inverse(errors[j].product) * errors[j].covariance;
  }

  static constexpr int kLooks = 9;
  std::vector<PoseError> errors;
  PoseError now;
  Keyframes keyframes;
  ScratchVector<PoseJacobian> J;

 private:
  CameraModel camera_{testing::makeCamera()};
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// Largest difference in the lower triangle, relative to the largest element.
double worstShare(const Walk& walk) {
  const KeyframeBatch looks(walk.keyframes, walk.now);
  SideMatrix covariance;
  looks.poseCovariance(walk.J, covariance);
  double worst = 0.0, largest = 0.0;
  for (std::size_t i = 0; i < walk.errors.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const Eigen::Matrix4d expected = walk.J[i] * walk.covariance(i, j) * walk.J[j].transpose();
      const Eigen::Matrix4d got = covariance.block<4, 4>(4 * static_cast<Eigen::Index>(i),
                                                         4 * static_cast<Eigen::Index>(j));
      for (int a = 0; a < 4; ++a) {
        for (int b = 0; b < (i == j ? a + 1 : 4); ++b) {
          worst = std::max(worst, std::abs(got(a, b) - expected(a, b)));
          largest = std::max(largest, std::abs(expected(a, b)));
        }
      }
    }
  }
  return worst / largest;
}

TEST(KeyframeBatch, PoseErrorsAreCorrelatedByTheirTransitions) {
  for (unsigned seed = 1; seed <= 10; ++seed) EXPECT_LT(worstShare(Walk(seed, 1.0)), 1e-9) << seed;
}

TEST(KeyframeBatch, PoseErrorsStayCorrelatedAfterCorrectionsOfTheOdometry) {
  for (unsigned seed = 1; seed <= 10; ++seed) EXPECT_LT(worstShare(Walk(seed, 0.5)), 1e-9) << seed;
}

TEST(KeyframeBatch, ThePresentPoseErrorIsCorrelatedWithEachKeyframe) {
  const Walk walk(3, 1.0);
  const KeyframeBatch looks(walk.keyframes, walk.now);
  for (std::size_t i = 0; i < looks.size(); ++i) {
    const Matrix6d expected =
        walk.now.product * inverse(walk.errors[i].product) * walk.errors[i].covariance;
    EXPECT_LT((looks.poseNow(i) - expected).cwiseAbs().maxCoeff(), 1e-12) << i;
  }
}

TEST(KeyframeBatch, RecognisesExactPoses) {
  Walk walk(4, 1.0);
  EXPECT_FALSE(KeyframeBatch(walk.keyframes, walk.now).exactPoses());
  for (auto& k : walk.keyframes) {
    Keyframe exact = *k;
    PoseError error = k->from->error;
    error.covariance.setZero();
    exact.from =
        std::make_shared<const FrameView>(k->from->view, error, k->from->time, k->from->styles);
    k = std::make_shared<const Keyframe>(exact);
  }
  EXPECT_TRUE(KeyframeBatch(walk.keyframes, walk.now).exactPoses());
}

}  // namespace
}  // namespace perdure::semantic_filter
