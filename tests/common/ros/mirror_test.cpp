#include "common/ros/mirror.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cstdlib>
#include <cstring>
#include <set>

#include "common/ros/bytes.h"
#include "common/ros/objects.h"

namespace perdure::ros {
namespace {

Objects oneCar(bool confirmed) {
  ObjectBelief car;
  car.id = 7;
  car.confirmed = confirmed;
  car.existence = 0.9;
  car.visibility = Visibility::kOccluded;
  car.classes.emplace_back();
  car.classes.back().name = "car";
  car.classes.back().probability = 1.0;
  car.classes.back().mean << 10, 2, 1, 0, std::log(4.0), std::log(2.0), std::log(1.5);
  Objects objects;
  objects.objects = {car};
  return objects;
}

std::vector<Eigen::Vector4f> pointsOf(const PointCloud2& cloud) {
  std::vector<Eigen::Vector4f> points(cloud.width);
  EXPECT_EQ(cloud.data->size(), points.size() * sizeof(Eigen::Vector4f));
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::memcpy(points[i].data(), cloud.data->data() + 16 * i, 16);
  }
  return points;
}

TEST(Obstacles, LieOnTheSidesOfConfirmedObjectsWithoutGaps) {
  const auto points = pointsOf(obstaclesOf(oneCar(true)));
  std::set<float> heights;
  std::vector<float> left;  // x of the points on the left side at the bottom
  for (const Eigen::Vector4f& p : points) {
    const float x = std::abs(p.x() - 10), y = std::abs(p.y() - 2);
    EXPECT_LE(x, 2.0001F);
    EXPECT_LE(y, 1.0001F);
    EXPECT_TRUE(x > 1.9999F || y > 0.9999F) << p.transpose();
    EXPECT_FLOAT_EQ(p.w(), 0.9F);
    heights.insert(p.z());
    if (p.y() > 2.9999F && p.z() < 0.2501F) left.push_back(p.x());
  }
  EXPECT_NEAR(*heights.begin(), 0.25, 1e-6) << "the centre is 1 m above, the car 1.5 m high";
  EXPECT_NEAR(*heights.rbegin(), 1.75, 1e-6);
  EXPECT_EQ(heights.size(), 7u);
  std::ranges::sort(left);
  ASSERT_GE(left.size(), 41u);
  for (std::size_t i = 1; i < left.size(); ++i) EXPECT_LE(left[i] - left[i - 1], 0.1001F);
  EXPECT_TRUE(pointsOf(obstaclesOf(oneCar(false))).empty());
}

struct Said {
  std::map<std::string, std::vector<std::uint8_t>> messages;
  Mirror mirror{"/perdure",
                [this](const Outlet& outlet, auto cdr) { messages[outlet.topic] = std::move(cdr); },
                [](const Outlet&) { return true; }};
};

TEST(Mirror, SaysTheClockOnlyIfAsked) {
  perdure::Odometry odometry;
  odometry.stamp.time = fromNanoseconds(12'000'000'034);
  Said said;
  said.mirror.onOdometry(odometry);
  EXPECT_FALSE(said.messages.contains("/clock"));
  said.mirror.sayClock(true);
  said.mirror.onOdometry(odometry);
  ASSERT_TRUE(said.messages.contains("/clock"));
  const auto clock = messageOf<Clock>(said.messages["/clock"], Encoding::kCdr, nullptr);
  ASSERT_TRUE(clock);
  EXPECT_EQ(clock->clock.sec, 12);
  EXPECT_EQ(clock->clock.nanosec, 34u);
}

/// Each topic of the RViz and Nav2 files is published, with the type that its display reads.
TEST(Mirror, PublishesWhatTheExamplesRead) {
  std::map<std::string, std::string> types;
  for (const Outlet& outlet : Said().mirror.outlets({"cam0"})) {
    types[outlet.topic] = outlet.type.substr(outlet.type.find('/') + 1);
  }
  const std::string folder = std::string(std::getenv("PERDURE_SOURCE")) + "/deploy/ros2/";
  std::size_t displays = 0;
  for (const auto& display :
       YAML::LoadFile(folder + "perdure.rviz")["Visualization Manager"]["Displays"]) {
    if (!display["Topic"]) continue;
    const auto kind = display["Class"].as<std::string>();
    EXPECT_EQ("rviz_default_plugins/" + types[display["Topic"]["Value"].as<std::string>()], kind);
    ++displays;
  }
  EXPECT_EQ(displays, 5u);
  const auto layer = YAML::LoadFile(folder + "nav2_costmap.yaml")["perdure_layer"]["perdure"];
  EXPECT_EQ(types[layer["topic"].as<std::string>()], layer["data_type"].as<std::string>());
}

}  // namespace
}  // namespace perdure::ros
