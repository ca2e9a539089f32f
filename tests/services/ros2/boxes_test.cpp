#include "services/ros2/core/boxes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/ros/objects.h"

namespace perdure::ros2 {
namespace {

const std::vector<std::string> kClasses{"car", "person", "bicycle"};

ros::Detection2D boxOf(double x, double w, std::vector<ros::ObjectHypothesis> scores) {
  ros::Detection2D one;
  one.bbox.center.position = {x, 20};
  one.bbox.size_x = w, one.bbox.size_y = 10;
  for (auto& score : scores) one.results.push_back({std::move(score), {}});
  return one;
}

std::vector<double> softMax(const std::vector<float>& activations) {
  double sum = 0;
  for (const float a : activations) sum += std::exp(a);
  std::vector<double> p;
  for (const float a : activations) p.push_back(std::exp(a) / sum);
  return p;
}

TEST(Ros2Boxes, ScoresComeBackBehindASoftMax) {
  const auto p = softMax(activationsOf({{0, 0.7}, {2, 0.2}}, 3, 0.4));
  EXPECT_NEAR(p[1], 0.7, 1e-5);
  EXPECT_NEAR(p[3], 0.2, 1e-5);
  EXPECT_NEAR(p[2], 0.04, 1e-5) << "a class that it does not name has its share of the rest";
  EXPECT_NEAR(p[0], 0.06, 1e-5);
  const auto all = softMax(activationsOf({{0, 0.7}, {1, 0.1}, {2, 0.1}}, 3, 0.4));
  EXPECT_NEAR(all[0], 0.1, 1e-5) << "where all are named the rest is clutter";
}

TEST(Ros2Boxes, ScoresOfClassesOneByOneAreEachAgainstItsContrary) {
  const auto a = activationsOf({{0, 0.9}, {1, 0.8}}, 3, 0.3);
  EXPECT_EQ(a[0], 0.0F);
  EXPECT_NEAR(a[1], std::log(9.0), 1e-5);
  EXPECT_NEAR(a[2], std::log(4.0), 1e-5);
  EXPECT_LT(a[3], -9.0F);
  for (const float one : activationsOf({{0, 1.0}}, 3, 0.3)) EXPECT_TRUE(std::isfinite(one));
  for (const float one : activationsOf({{0, 1e-300}}, 1, 0.0)) EXPECT_TRUE(std::isfinite(one));
}

TEST(Ros2Boxes, ReadsNamesAndNumbersAndRefusesWhatIsNone) {
  ros::Detection2DArray message;
  message.detections = {boxOf(30, 8, {{"Person", 0.6}}), boxOf(30, 8, {{"2", 0.6}}),
                        boxOf(30, -8, {{"car", 0.6}}),   boxOf(std::nan(""), 8, {{"car", 0.6}}),
                        boxOf(30, 8, {{"3", 0.6}}),      boxOf(30, 8, {{"car", std::nan("")}}),
                        boxOf(1e300, 8, {{"car", 0.5}}), boxOf(30, 8, {})};
  message.detections.push_back(boxOf(30, 8, {{"car", 0.5}}));
  message.detections.back().bbox.center.theta = 0.7;
  const BoxesRead read = boxesOf(message, kClasses, 0.3);
  ASSERT_EQ(read.detections.size(), 2u);
  EXPECT_EQ(read.detections[0].box.x1, 26);
  EXPECT_EQ(read.detections[0].box.y2, 25);
  EXPECT_GT(read.detections[0].activations[2], read.detections[0].activations[1]);
  EXPECT_GT(read.detections[1].activations[3], read.detections[1].activations[1]);
  ReasonCounts refused;
  for (const Reason& reason : read.refused) refused.add(reason);
  EXPECT_EQ(refused.of("box_malformed"), 4u);
  EXPECT_EQ(refused.of("class_unknown"), 1u);
  EXPECT_EQ(refused.of("score_malformed"), 1u);
}

/// Boxes that the bridge writes are read back unchanged.
TEST(Ros2Boxes, AreThoseOfTheMirror) {
  Detections out;
  out.camera = "cam0";
  out.detections.resize(1);
  out.detections[0].box = {10, 20, 30, 44};
  for (const double p : {0.15, 0.6, 0.2, 0.05})
    out.detections[0].activations.push_back(static_cast<float>(std::log(p)));
  ModelInfo model;
  model.classes = kClasses;
  const auto read = boxesOf(ros::detections2dOf(out, &model), kClasses, 0.3);
  ASSERT_EQ(read.detections.size(), 1u);
  EXPECT_EQ(read.detections[0].box.x2, 30);
  EXPECT_EQ(read.detections[0].box.y1, 20);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(read.detections[0].activations[k], out.detections[0].activations[k], 1e-4);
}

TEST(Ros2FrameBook, FindsFramesByStampsThatWereKeptAsSeconds) {
  FrameBook book;
  for (int i = 0; i < 100; ++i) {
    book.add(fromNanoseconds(1'700'000'000'000'000'000 + i * 5'000'000LL),
             {1, static_cast<std::uint64_t>(i), {}, 0});
  }
  const auto at = [](double seconds) { return TimePoint(durationFromSeconds(seconds)); };
  ASSERT_NE(book.find(at(1'700'000'000.25)), nullptr);
  EXPECT_EQ(book.find(at(1'700'000'000.25))->sequence, 50u);
  EXPECT_EQ(book.find(at(1'700'000'000.2525)), nullptr) << "between two frames";
  EXPECT_EQ(book.find(at(1'700'000'000.0)), nullptr) << "too long ago";
  EXPECT_FALSE(book.isAfterAll(at(1'700'000'000.4955)));
  EXPECT_TRUE(book.isAfterAll(at(1'700'000'000.5)));
}

}  // namespace
}  // namespace perdure::ros2
