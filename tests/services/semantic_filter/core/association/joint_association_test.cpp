#include "services/semantic_filter/core/association/joint_association.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace perdure::semantic_filter {
namespace {

/// P(track j made box z) and P(some track made box z), summed over all one-to-one associations.
struct Exact {
  Eigen::MatrixXd made;
  double total = 0.0;

  Exact(const Eigen::MatrixXd& psi, const Eigen::VectorXd& fresh)
      : made(Eigen::MatrixXd::Zero(psi.rows(), psi.cols())) {
    std::vector<int> choice(static_cast<std::size_t>(psi.rows()), -1);
    visit(psi, fresh, 0, 1.0, choice);
    made /= total;
  }
  void visit(const Eigen::MatrixXd& psi, const Eigen::VectorXd& fresh, Eigen::Index j,
             double weight, std::vector<int>& choice) {
    if (j == psi.rows()) {
      total += weight;
      for (Eigen::Index i = 0; i < psi.rows(); ++i) {
        if (choice[i] >= 0) made(i, choice[i]) += weight;
      }
      return;
    }
    choice[j] = -1;
    visit(psi, fresh, j + 1, weight, choice);
    for (int z = 0; z < psi.cols(); ++z) {
      bool taken = false;
      for (Eigen::Index i = 0; i < j; ++i) taken = taken || choice[i] == z;
      if (taken) continue;
      choice[j] = z;
      visit(psi, fresh, j + 1, weight * psi(j, z) / fresh[z], choice);
    }
    choice[j] = -1;
  }
};

Eigen::MatrixXd marginals(const Eigen::MatrixXd& psi, const Association& a) {
  Eigen::MatrixXd p = psi.cwiseProduct(a.eta);
  for (Eigen::Index j = 0; j < p.rows(); ++j) p.row(j) /= 1.0 + p.row(j).sum();
  return p;
}

TEST(JointAssociation, IsExactForOneTrackAndManyBoxes) {
  Eigen::MatrixXd psi(1, 3);
  psi << 4.0, 0.5, 9.0;
  const Eigen::VectorXd fresh = Eigen::Vector3d(1.0, 2.0, 1.5);
  const Exact exact(psi, fresh);
  EXPECT_LT((marginals(psi, associate(psi, fresh)) - exact.made).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(JointAssociation, IsExactForManyTracksAndOneBox) {
  Eigen::MatrixXd psi(3, 1);
  psi << 4.0, 0.5, 9.0;
  const Eigen::VectorXd fresh = Eigen::VectorXd::Constant(1, 1.3);
  const Exact exact(psi, fresh);
  const Association a = associate(psi, fresh);
  EXPECT_LT((marginals(psi, a) - exact.made).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_NEAR(a.explained[0], exact.made.sum(), 1e-8);
}

TEST(JointAssociation, IsNearTheExactMarginalsOnSmallCases) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> log_weight(-3.0, 4.0);
  double worst = 0.0, mean = 0.0;
  constexpr int kCases = 200;
  for (int n = 0; n < kCases; ++n) {
    Eigen::MatrixXd psi(3, 4);
    for (Eigen::Index i = 0; i < psi.size(); ++i) psi(i) = std::exp(log_weight(random));
    const Eigen::VectorXd fresh = Eigen::VectorXd::Constant(4, 1.2);
    const Exact exact(psi, fresh);
    const double error = (marginals(psi, associate(psi, fresh)) - exact.made).cwiseAbs().maxCoeff();
    worst = std::max(worst, error);
    mean += error / kCases;
  }
  EXPECT_LT(mean, 0.05);
  EXPECT_LT(worst, 0.25);
}

TEST(JointAssociation, ABoxThatMatchesNoTrackIsNotExplained) {
  const Association a = associate(Eigen::MatrixXd::Zero(2, 2), Eigen::Vector2d(1.0, 1.0));
  EXPECT_EQ(a.explained[0], 0.0);
  EXPECT_EQ(a.eta(1, 1), 1.0);
}

TEST(JointAssociation, WorksWithoutTracksAndWithoutBoxes) {
  EXPECT_EQ(associate(Eigen::MatrixXd(0, 2), Eigen::Vector2d(1, 1)).explained.size(), 2);
  EXPECT_EQ(associate(Eigen::MatrixXd(2, 0), Eigen::VectorXd(0)).explained.size(), 0);
}

}  // namespace
}  // namespace perdure::semantic_filter
