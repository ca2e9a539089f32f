#include "common/earth/earth_place.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <sstream>

#include "common/earth/geodesy.h"
#include "common/math/so3.h"
#include "services/map_store/core/earth_anchor.h"
#include "services/map_store/node.h"

namespace perdure::map_store {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

GeoAnchor anchorAt(TimePoint time, double yaw = 30.0 * kDegree) {
  return GeoAnchor{time, 49.0, 8.4, 110.0, yaw};
}

Calibration rigWith(const GeoAnchor& anchor) {
  Calibration rig;
  rig.anchor = anchor;
  return rig;
}

Odometry poseAt(TimePoint time, const WorldId& world, const RigidTransform& T_WB) {
  Odometry odometry;
  odometry.stamp.time = time;
  odometry.world = world;
  odometry.state = OdometryState::kTracking;
  odometry.T_WB = T_WB;
  return odometry;
}

std::vector<double> numbersOf(const std::string& text) {
  std::vector<double> numbers;
  std::istringstream stream(text);
  for (double number = 0.0; stream >> number;) numbers.push_back(number);
  return numbers;
}

std::optional<RigidTransform> itself(TimePoint) { return RigidTransform(); }

TEST(EarthAnchor, ATextOfTheFileThatIsNoPlaceIsNone) {
  EXPECT_EQ(earthAnchorFrom("47.28 8.56 547.6 -30"),
            (std::vector<double>{47.28, 8.56, 547.6, -30}));
  for (const char* text : {"", "47.28 8.56 547.6", "47.28 8.56 547.6 0 1", "91 8 0 0", "1 181 0 0",
                           "1 2 1e300 0", "1 2 3 1e9", "1 2 x 3", "1e999 2 3 4", "nan 2 3 4"}) {
    EXPECT_TRUE(earthAnchorFrom(text).empty()) << text;
  }
}

/// With the anchor of the map, the body is at the receiver's position.
TEST(EarthPlace, TheMapsOriginAndAxisLeadBackToTheBody) {
  const RigidTransform T_MB(rotationAboutZ(1.1), Eigen::Vector3d(700.0, -900.0, 4.0));
  const GeoAnchor anchor = anchorAt(TimePoint());
  const auto map = numbersOf(earthAnchorOfMap(anchor, T_MB));
  ASSERT_EQ(map.size(), 4U);
  const GeoReference onEarth({{}, map[0], map[1], map[2], map[3] * kDegree}, RigidTransform());
  const Eigen::Vector3d back = toEcef(onEarth(T_MB.p)), there = toEcef({49.0, 8.4, 110.0});
  EXPECT_LT((back - there).norm(), 0.25) << "a plane touches the Earth at one place alone";
  const Eigen::Vector3d ahead = toEcef(onEarth(T_MB * Eigen::Vector3d(100.0, 0.0, 0.0)));
  const Eigen::Vector3d x = enuAxes({49.0, 8.4, 110.0}).transpose() * (ahead - back);
  EXPECT_NEAR(std::atan2(x.y(), x.x()), 30.0 * kDegree, 1e-4);
  EXPECT_GT(std::abs(map[3] - (30.0 - 1.1 / kDegree)), 5e-4) << "north turns with the longitude";
}

TEST(EarthPlace, TakesThePoseAtTheAnchorsTime) {
  const WorldId world{7, 1};
  const TimePoint start = fromNanoseconds(1'000'000'000);
  EarthPlace place;
  place.onOdometry(poseAt(start, world, {}));
  place.onCalibration(rigWith(anchorAt(start + std::chrono::milliseconds(25), 0.0)));
  EXPECT_FALSE(place.ofMap(world, itself));
  place.onOdometry(poseAt(start + std::chrono::milliseconds(100), world,
                          {Eigen::Quaterniond::Identity(), {400.0, 0.0, 0.0}}));
  const auto map = place.ofMap(world, itself);
  ASSERT_TRUE(map);
  const auto numbers = numbersOf(*map);
  EXPECT_NEAR((8.4 - numbers[1]) * 73172.8, 100.0, 0.01) << "a quarter of the way east";
  EXPECT_FALSE(place.ofMap(WorldId{8, 1}, itself));
  EXPECT_FALSE(place.ofMap(world, [](TimePoint) { return std::optional<RigidTransform>(); }));
}

TEST(EarthPlace, WaitsForNoPoseThatWillNotCome) {
  const WorldId world{7, 1};
  const TimePoint start = fromNanoseconds(5'000'000'000);
  const auto known = [&](std::chrono::milliseconds before, std::chrono::milliseconds after,
                         const WorldId& other) {
    EarthPlace place;
    place.onCalibration(rigWith(anchorAt(start)));
    place.onOdometry(poseAt(start - before, world, {}));
    place.onOdometry(poseAt(start + after, other, {}));
    return place.known().has_value();
  };
  using std::chrono::milliseconds;
  EXPECT_TRUE(known(milliseconds(50), milliseconds(50), world));
  EXPECT_TRUE(known(milliseconds(50), milliseconds(0), world));
  EXPECT_FALSE(known(milliseconds(50), milliseconds(1050), world)) << "a gap";
  EXPECT_FALSE(known(milliseconds(50), milliseconds(50), WorldId{8, 1})) << "another W";
  EXPECT_FALSE(known(milliseconds(-50), milliseconds(100), world)) << "before the first pose";
}

/// The next session gives no position until it is located on the map, because its W is not M.
TEST(EarthPlace, IsKeptInTheMapsFile) {
  const auto folder = std::filesystem::temp_directory_path() / "perdure_earth_place_test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  Config config;
  config.store_path = (folder / "map.sqlite").string();
  const auto stored = [&] {
    const auto connection = openStoreForReading(config.store_path);
    return numbersOf(MapReader(&connection).earthAnchor().value_or("none"));
  };
  const auto drive = [&](const WorldId& world, double x, bool with_anchor) {
    Node node(config, 1,
              {[](const MapTile&) {}, [](const MapTile&) {}, [](const MapHeader&) {},
               [](const MapReply&) {}, [](const MapNear&) {}});
    const TimePoint time = fromNanoseconds(static_cast<std::int64_t>(world.world) * 10'000'000'000);
    if (with_anchor) node.onCalibration(rigWith(anchorAt(time, 0.0)));
    node.onOdometry(poseAt(time, world, {Eigen::Quaterniond::Identity(), {x, 0.0, 0.0}}));
    Objects objects;
    objects.stamp.time = time;
    objects.world = world;
    node.onObjects(objects);
    node.flush();
  };
  drive(WorldId{1, 1}, 73.1728, true);
  const auto numbers = stored();
  ASSERT_EQ(numbers.size(), 4U);
  EXPECT_NEAR(numbers[0], 49.0, 1e-7);
  EXPECT_NEAR(numbers[1], 8.399, 1e-7);
  EXPECT_NEAR(numbers[3], 0.0, 1e-2);
  drive(WorldId{2, 1}, 0.0, true);
  EXPECT_EQ(stored(), numbers);
  drive(WorldId{2, 1}, 0.0, false);
  EXPECT_EQ(stored(), numbers) << "what is known stays";
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace perdure::map_store
