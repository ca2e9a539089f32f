#include "services/capture/vehicle/earth_anchor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace perdure::capture {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// A drive with five fixes per second.
struct Drive {
  GnssFix fix{0, 49.0, 8.4, 110.0, 2.0, 10.0, 0.5};
  std::optional<EarthPlace> next(EarthAnchor& anchor, bool backwards = false) {
    fix.time_ns += 200'000'000;
    return anchor.offer(fix, backwards);
  }
  /// Returns the number of fixes until one is accepted; 0 if none of the first `most` is.
  int until(EarthAnchor& anchor, int most, std::optional<EarthPlace>* place = nullptr) {
    for (int n = 1; n <= most; ++n) {
      const auto taken = next(anchor);
      if (taken && place) *place = taken;
      if (taken) return n;
    }
    return 0;
  }
};

TEST(EarthAnchor, IsTakenOnAStraightDriveAndOnce) {
  EarthAnchor anchor({});
  Drive drive;
  std::optional<EarthPlace> place;
  EXPECT_EQ(drive.until(anchor, 40, &place), 11) << "two seconds";
  ASSERT_TRUE(place);
  EXPECT_NEAR(place->latitude_deg, 49.0, 1e-12);
  EXPECT_DOUBLE_EQ(place->yaw, 0.5);
  EXPECT_EQ(place->time_ns, drive.fix.time_ns);
  EXPECT_EQ(drive.until(anchor, 40), 0);
  drive.fix.sigma_m = 0.9;
  EXPECT_EQ(drive.until(anchor, 1), 1) << "less than half as uncertain";
  drive.fix.sigma_m = 1.0;
  EXPECT_EQ(drive.until(anchor, 300), 150) << "after half a minute, for who had no pose before";
  drive.fix.sigma_m = 1.2;
  EXPECT_EQ(drive.until(anchor, 300), 0) << "but no worse one";
}

TEST(EarthAnchor, IsNotTakenWhereItsHeadingIsNotKnown) {
  const auto taken = [](auto&& change) {
    EarthAnchor anchor({});
    Drive drive;
    for (int i = 0; i < 40; ++i) {
      const bool backwards = change(drive.fix, i);
      if (drive.next(anchor, backwards)) return true;
    }
    return false;
  };
  EXPECT_TRUE(taken([](GnssFix&, int) { return false; }));
  EXPECT_FALSE(taken([](GnssFix&, int) { return true; })) << "backwards";
  EXPECT_FALSE(taken([](GnssFix& f, int) { return f.speed = 1.5, false; })) << "slow";
  EXPECT_FALSE(taken([](GnssFix& f, int) { return f.course.reset(), false; }));
  EXPECT_FALSE(taken([](GnssFix& f, int i) { return f.course = 0.3 * kDegree * i, false; }))
      << "in a bend";
  EXPECT_FALSE(taken([](GnssFix& f, int i) {
    return f.time_ns += i % 5 ? 0 : 2'000'000'000, false;
  })) << "with gaps";
  EXPECT_FALSE(taken([](GnssFix& f, int) { return f.sigma_m = 5.1, false; }));
  EXPECT_FALSE(taken([](GnssFix& f, int) { return f.sigma_m = std::nan(""), false; }));
  EXPECT_TRUE(taken([](GnssFix& f, int i) {
    return f.course = std::remainder(std::numbers::pi + (i % 2 ? 0.5 : -0.5) * kDegree,
                                     2.0 * std::numbers::pi),
           false;
  })) << "straight, where angles go round";
}

TEST(EarthAnchor, TellsWhereTheBodyIsByItsAntenna) {
  // Heading north; the antenna is 2 m ahead, 1 m to the left (west) and 1.5 m up.
  EarthAnchor anchor({5.0, {2.0, 1.0, 1.5}});
  Drive drive;
  drive.fix.course = std::numbers::pi / 2;
  std::optional<EarthPlace> place;
  ASSERT_NE(drive.until(anchor, 40, &place), 0);
  // One degree of latitude is 111 200.8 m at 49°, one degree of longitude 73 172.8 m (WGS 84).
  EXPECT_NEAR((place->latitude_deg - 49.0) * 111200.8, -2.0, 1e-3);
  EXPECT_NEAR((place->longitude_deg - 8.4) * 73172.8, 1.0, 1e-3);
  EXPECT_NEAR(place->height_m, 108.5, 1e-5);
}

}  // namespace
}  // namespace perdure::capture
