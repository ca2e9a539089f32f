#include "tools/map/render.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

namespace perdure::tools {
namespace {

using ::testing::HasSubstr;

MapObject car() {
  MapObject object;
  object.id = 12;
  object.world = {5, 2};
  object.class_name = "car";
  object.existence = 0.99;
  object.class_probability = 0.95;
  object.mean << 100.0, 0.0, -1.0, 0.5, std::log(4.0), std::log(1.6), std::log(1.5);
  object.covariance = Matrix7d::Identity() * 0.04;
  object.hits = 31;
  return object;
}

TEST(MapRender, ShowsSizesInMetresAndDeviationsOfThem) {
  const std::string text = toText(car());
  EXPECT_THAT(text, HasSubstr("size         4.000 1.600 1.500 m, sigma 0.800 0.320 0.300"));
  EXPECT_THAT(text, HasSubstr("position     100.000 0.000 -1.000 m, sigma 0.200"));
  EXPECT_THAT(toTable({car()}), HasSubstr("100.00"));
}

TEST(MapRender, GivesLongitudeFirstAndTurnsByTheAnchorsYaw) {
  const GeoAnchor north{{}, 49.0, 8.4, 110.0, std::numbers::pi / 2};
  const auto json = toGeoJson({car()}, north);
  EXPECT_EQ(json["type"], "FeatureCollection");
  EXPECT_EQ(json["georeferenced"], true);
  const auto& at = json["features"][0]["geometry"]["coordinates"];
  // 100 m north; one degree of the meridian is 111.2 km at this latitude.
  EXPECT_NEAR(at[0].get<double>(), 8.4, 1e-7);
  EXPECT_NEAR(at[1].get<double>() - 49.0, 100.0 / 111'200.0, 2e-6);
  EXPECT_NEAR(at[2].get<double>(), 109.0, 0.01);
  EXPECT_EQ(json["features"][0]["properties"]["local_m"][0], 100.0);
}

TEST(MapRender, SaysThatItIsNotGeoreferencedWithoutAnAnchor) {
  EXPECT_EQ(toGeoJson({car()}, std::nullopt)["georeferenced"], false);
}

TEST(MapRender, WritesTheCovarianceAsAMatrix) {
  const auto json = toJson(car());
  ASSERT_EQ(json["covariance"].size(), 7u);
  EXPECT_EQ(json["covariance"][6].size(), 7u);
  EXPECT_EQ(json["covariance"][3][3], 0.04);
  EXPECT_EQ(json["visibility"], "out_of_view");
}

}  // namespace
}  // namespace perdure::tools
