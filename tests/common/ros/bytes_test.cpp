// Serialised ROS messages: known bytes, both byte orders, and malformed input.
#include "common/ros/bytes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/ros/definition.h"

namespace perdure::ros {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::uint8_t> bytesOf(std::initializer_list<int> values) {
  return {values.begin(), values.end()};
}

TransformStamped exampleTransform() {
  TransformStamped one;
  one.header = {{7, 9}, "map"};
  one.child_frame_id = "odom";
  one.transform.translation = {1.5, -2.0, 0.25};
  return one;
}

TEST(Cdr, IsWhatRos2Writes) {
  const std::vector<std::uint8_t> known = bytesOf(
      {0, 1, 0, 0,                                    // XCDR1, little-endian
       7, 0, 0, 0, 9,   0,   0,   0,                  // stamp
       4, 0, 0, 0, 'm', 'a', 'p', 0,                  // a string ends with a zero byte
       6, 0, 0, 0, 'j', 'p', 'e', 'g', '8', 0, 0, 0,  // the next field is aligned to its own size
       3, 0, 0, 0, 1,   2,   3});
  const auto data = std::make_shared<const std::vector<std::uint8_t>>(bytesOf({1, 2, 3}));
  EXPECT_EQ(cdrOf(CompressedImage{{{7, 9}, "map"}, "jpeg8", data}), known);
}

TEST(Cdr, NumbersOfEightBytesBeginAtEightBehindTheHead) {
  const auto bytes = cdrOf(exampleTransform());
  // Stamp 8, "map" 8, "odom" 9, padded to 32.
  ASSERT_EQ(bytes.size(), 4u + 32u + 7u * 8u);
  double y = 0;
  std::memcpy(&y, bytes.data() + 4 + 32 + 8, sizeof y);
  EXPECT_EQ(y, -2.0);
}

struct Small {
  static constexpr char kType[] = "test/Small";
  Header header;
  std::vector<double> values;
  static void fields(auto& m, auto& a) { a("header", m.header), a("values", m.values); }
};

/// The bytes of a big-endian machine.
TEST(Cdr, EitherByteOrderIsRead) {
  const auto bytes = bytesOf({0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0,    9,    0, 0, 0, 2, 'm', 0,
                              0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0x3F, 0xF8, 0, 0, 0, 0, 0,   0});
  const auto read = messageOf<Small>(bytes, Encoding::kCdr, nullptr);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->header.stamp.sec, 7);
  EXPECT_EQ(read->header.frame_id, "m");
  EXPECT_THAT(read->values, ElementsAre(1.5));
}

TEST(Ros1, HasANumberInTheHeaderAndNoGaps) {
  auto bytes = bytesOf({42,  0,   0, 0, 7, 0, 0,   0,   9,   0,   0, 0, 3, 0, 0, 0, 'm',
                        'a', 'p', 4, 0, 0, 0, 'j', 'p', 'e', 'g', 2, 0, 0, 0, 8, 9});
  const auto read = messageOf<CompressedImage>(bytes, Encoding::kRos1, nullptr);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->header.stamp.nanosec, 9u);
  EXPECT_EQ(read->format, "jpeg");
  EXPECT_THAT(*read->data, ElementsAre(8, 9));
  bytes.pop_back();
  EXPECT_FALSE(messageOf<CompressedImage>(bytes, Encoding::kRos1, nullptr));
}

Detection3DArray exampleDetections() {
  Detection3DArray all;
  all.header = {{1, 2}, "odom"};
  for (const char* id : {"12", "7"}) {
    Detection3D one;
    one.id = id;
    one.bbox.center.position = {1, 2, 3};
    one.bbox.size = {4.2, 1.8, 1.5};
    one.results.resize(2);
    one.results[1].hypothesis = {"car", 0.75};
    one.results[1].pose.covariance[35] = 0.01;
    all.detections.push_back(one);
  }
  return all;
}

TEST(Cdr, GivesBackWhatWasWritten) {
  const auto read =
      messageOf<Detection3DArray>(cdrOf(exampleDetections()), Encoding::kCdr, nullptr);
  ASSERT_TRUE(read);
  EXPECT_EQ(cdrOf(*read), cdrOf(exampleDetections()));
  EXPECT_EQ(read->detections[1].results[1].hypothesis.class_id, "car");
}

TEST(Cdr, TakesAnyBytes) {
  const auto whole = cdrOf(exampleDetections());
  std::mt19937_64 random(5);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    auto bytes = whole;
    for (std::uint64_t n = 1 + random() % 4; n > 0; --n)
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    if (random() % 3 == 0) bytes.resize(random() % bytes.size());
    refused += messageOf<Detection3DArray>(bytes, Encoding::kCdr, nullptr) ? 0 : 1;
  }
  EXPECT_GT(refused, 500);
}

TEST(Cdr, RulesThatAreNotKnownAreRefused) {
  auto bytes = cdrOf(exampleTransform());
  bytes[1] = 3;  // parameter lists
  EXPECT_EQ(messageOf<TransformStamped>(bytes, Encoding::kCdr, nullptr).error().code, "malformed");
}

TEST(Definition, HasTheNamesOfBothRos) {
  EXPECT_EQ(ros2Name("sensor_msgs/Image"), "sensor_msgs/msg/Image");
  EXPECT_EQ(plainName("sensor_msgs/msg/Image"), "sensor_msgs/Image");
  EXPECT_EQ(plainName("sensor_msgs/Image"), "sensor_msgs/Image");
}

TEST(Definition, IsTheMessageAndThenItsParts) {
  const std::string text = definitionOf<TFMessage>();
  EXPECT_THAT(text, testing::StartsWith("geometry_msgs/TransformStamped[] transforms\n====="));
  EXPECT_THAT(text, HasSubstr("MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"));
  EXPECT_THAT(definitionOf<PointCloud2>(), HasSubstr("sensor_msgs/PointField[] fields\n"));
  EXPECT_THAT(definitionOf<DiagnosticArray>(), HasSubstr("byte level\n"));
  EXPECT_THAT(definitionOf<Imu>(), HasSubstr("float64[9] orientation_covariance\n"));
}

}  // namespace
}  // namespace perdure::ros
