#include <gtest/gtest.h>

#include "services/semantic_filter/core/belief/learned.h"

namespace perdure::semantic_filter {
namespace {

constexpr std::uint64_t kNetwork = 17, kOther = 18;

TEST(BoxExtents, AreThoseOfCuboidsUntilTheObjectsSpeakClearly) {
  BoxExtents extents;
  for (int i = 0; i < 5; ++i) extents.learn(kNetwork, 1.0);
  EXPECT_FALSE(extents.outlines(kNetwork));
  extents.learn(kNetwork, 2.0);
  EXPECT_TRUE(extents.outlines(kNetwork));
  EXPECT_FALSE(extents.outlines(kOther));
}

TEST(BoxExtents, OddsAboutZeroChangeNothing) {
  BoxExtents extents;
  extents.learn(kNetwork, 7.0);
  extents.learn(kNetwork, -10.0);
  EXPECT_TRUE(extents.outlines(kNetwork)) << "-3 nats";
  extents.learn(kNetwork, -4.0);
  EXPECT_FALSE(extents.outlines(kNetwork));
}

TEST(BoxExtents, AreDecidedByMuchEvidenceForEither) {
  for (const double sign : {-1.0, 1.0}) {
    BoxExtents extents;
    extents.learn(kNetwork, 29.0 * sign);
    EXPECT_FALSE(extents.decided(kNetwork));
    extents.learn(kNetwork, 2.0 * sign);
    EXPECT_TRUE(extents.decided(kNetwork));
    EXPECT_FALSE(extents.decided(kOther));
  }
}

}  // namespace
}  // namespace perdure::semantic_filter
