#include "common/ros/autoware.h"

#include <gtest/gtest.h>

#include <numbers>

#include "common/ros/bytes.h"
#include "common/ros/definition.h"

namespace perdure::ros::autoware {
namespace {

ObjectBelief objectOf(ObjectId id, std::vector<std::pair<std::string, double>> classes) {
  ObjectBelief object;
  object.id = id;
  object.confirmed = true;
  object.existence = 0.9;
  for (const auto& [name, probability] : classes) {
    object.classes.emplace_back();
    object.classes.back().name = name;
    object.classes.back().probability = probability;
    object.classes.back().mean << 10, 2, 1, 0, std::log(4.0), std::log(2.0), std::log(1.5);
    object.classes.back().covariance = Matrix7d::Identity();
    object.classes.back().covariance.diagonal() << 0.01, 0.04, 0.09, 0.16, 1, 1, 1;
  }
  return object;
}

/// W is rotated to the left in M, and 100 m to its left.
const RigidTransform kTurned(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2,
                                                                  Eigen::Vector3d::UnitZ())),
                             Eigen::Vector3d(0, 100, 0));

TrackedObject only(const ObjectBelief& object) {
  Objects objects;
  objects.objects = {object};
  auto message = trackedObjectsOf(objects, kTurned);
  EXPECT_EQ(message.header.frame_id, "map");
  EXPECT_EQ(message.objects.size(), 1u);
  return message.objects.at(0);
}

TEST(TrackedObjects, AreInMWithTheirCovariance) {
  const TrackedObject one = only(objectOf(0x0102, {{"car", 1.0}}));
  const auto& pose = one.kinematics.pose_with_covariance;
  EXPECT_NEAR(pose.pose.position.x, -2, 1e-9);
  EXPECT_NEAR(pose.pose.position.y, 110, 1e-9);
  EXPECT_NEAR(pose.pose.position.z, 1, 1e-9);
  EXPECT_NEAR(pose.pose.orientation.z, std::sqrt(0.5), 1e-9);
  EXPECT_NEAR(pose.covariance[0], 0.04, 1e-9) << "what was y in W";
  EXPECT_NEAR(pose.covariance[7], 0.01, 1e-9);
  EXPECT_NEAR(pose.covariance[14], 0.09, 1e-9);
  EXPECT_NEAR(pose.covariance[35], 0.16, 1e-9);
  EXPECT_EQ(pose.covariance[21], 0) << "it stands upright";
  EXPECT_EQ(one.object_id.uuid[15], 2);
  EXPECT_EQ(one.object_id.uuid[14], 1);
  EXPECT_NEAR(one.shape.dimensions.y, 2, 1e-9);
}

TEST(TrackedObjects, SumClassesOfOneLabel) {
  const TrackedObject one =
      only(objectOf(1, {{"car", 0.4}, {"person", 0.35}, {"van", 0.2}, {"chair", 0.05}}));
  ASSERT_EQ(one.classification.size(), 3u);
  EXPECT_EQ(one.classification[0].label, ObjectClassification::kCar);
  EXPECT_NEAR(one.classification[0].probability, 0.6, 1e-6);
  EXPECT_EQ(one.classification[1].label, ObjectClassification::kPedestrian);
  EXPECT_EQ(one.classification[2].label, ObjectClassification::kUnknown);
}

TEST(TrackedObjects, TellHowTheyMoveInTheirOwnFrame) {
  ObjectBelief object = objectOf(1, {{"car", 1.0}});
  object.classes[0].mean[3] = std::numbers::pi / 2;
  object.moving = 0.8;
  object.velocity = {0, 5, 0};
  const auto moves = only(object).kinematics;
  EXPECT_NEAR(moves.twist_with_covariance.twist.linear.x, 5, 1e-9);
  EXPECT_NEAR(moves.twist_with_covariance.twist.linear.y, 0, 1e-9);
  EXPECT_FALSE(moves.is_stationary);
  EXPECT_EQ(moves.orientation_availability, TrackedObjectKinematics::kAvailable);
  object.moving = 0.1;
  EXPECT_EQ(only(object).kinematics.orientation_availability,
            TrackedObjectKinematics::kSignUnknown);
  object.classes[0].covariance(3, 3) = 1.5;
  EXPECT_EQ(only(object).kinematics.orientation_availability,
            TrackedObjectKinematics::kUnavailable);
}

TEST(TrackedObjects, LeaveOutWhatIsNotConfirmedAndComeBackFromTheirBytes) {
  Objects objects;
  objects.objects = {objectOf(1, {{"car", 1.0}}), objectOf(2, {{"bus", 1.0}})};
  objects.objects[0].confirmed = false;
  const auto message = trackedObjectsOf(objects, {});
  ASSERT_EQ(message.objects.size(), 1u);
  const auto bytes = cdrOf(message);
  const auto back = messageOf<TrackedObjects>(bytes, Encoding::kCdr, nullptr);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->objects.at(0).classification.at(0).label, ObjectClassification::kBus);
  EXPECT_EQ(back->objects.at(0).shape.dimensions.x, message.objects[0].shape.dimensions.x);
  const std::string text = definitionOf<TrackedObjects>();
  EXPECT_NE(text.find("uint8[16] uuid"), std::string::npos) << text;
  EXPECT_NE(text.find("autoware_perception_msgs/TrackedObject[] objects"), std::string::npos);
}

}  // namespace
}  // namespace perdure::ros::autoware
