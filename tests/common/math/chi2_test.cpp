#include "common/math/chi2.h"

#include <gtest/gtest.h>

namespace perdure {
namespace {

// Values from printed tables; the last one is given to three decimals.
TEST(Chi2, QuantilesAgreeWithPublishedTables) {
  EXPECT_NEAR(chi2Quantile(0.95, 1), 3.841459, 1e-6);
  EXPECT_NEAR(chi2Quantile(0.95, 2), 5.991465, 1e-6);
  EXPECT_NEAR(chi2Quantile(0.99, 7), 18.475307, 1e-6);
  EXPECT_NEAR(chi2Quantile(0.025, 30), 16.790772, 1e-6);
  EXPECT_NEAR(chi2Quantile(0.95, 300), 341.395, 1e-3);
}

TEST(Chi2, DistributionInvertsQuantile) {
  for (const int dof : {1, 3, 10, 100}) {
    for (const double p : {0.001, 0.3, 0.9, 0.9999}) {
      EXPECT_NEAR(chi2Cdf(chi2Quantile(p, dof), dof), p, 1e-9);
    }
  }
}

}  // namespace
}  // namespace perdure
