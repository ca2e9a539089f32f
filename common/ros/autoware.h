// Objects for Autoware: autoware_perception_msgs/TrackedObjects since version 1.0.
#pragma once

#include "common/ros/messages.h"
#include "common/types/objects.h"

namespace perdure::ros::autoware {

struct Uuid {
  static constexpr char kType[] = "unique_identifier_msgs/UUID";
  std::array<std::uint8_t, 16> uuid{};
  static void fields(auto& m, auto& a) { a("uuid", m.uuid); }
};

struct Accel {
  static constexpr char kType[] = "geometry_msgs/Accel";
  Vector3 linear, angular;
  static void fields(auto& m, auto& a) { a("linear", m.linear), a("angular", m.angular); }
};

struct AccelWithCovariance {
  static constexpr char kType[] = "geometry_msgs/AccelWithCovariance";
  Accel accel;
  std::array<double, 36> covariance{};
  static void fields(auto& m, auto& a) { a("accel", m.accel), a("covariance", m.covariance); }
};

struct Point32 {
  static constexpr char kType[] = "geometry_msgs/Point32";
  float x = 0, y = 0, z = 0;
  static void fields(auto& m, auto& a) { a("x", m.x), a("y", m.y), a("z", m.z); }
};

struct Polygon {
  static constexpr char kType[] = "geometry_msgs/Polygon";
  std::vector<Point32> points;
  static void fields(auto& m, auto& a) { a("points", m.points); }
};

struct ObjectClassification {
  static constexpr char kType[] = "autoware_perception_msgs/ObjectClassification";
  static constexpr std::uint8_t kUnknown = 0, kCar = 1, kTruck = 2, kBus = 3, kTrailer = 4,
                                kMotorcycle = 5, kBicycle = 6, kPedestrian = 7, kAnimal = 8;
  std::uint8_t label = kUnknown;
  float probability = 0;
  static void fields(auto& m, auto& a) { a("label", m.label), a("probability", m.probability); }
};

struct TrackedObjectKinematics {
  static constexpr char kType[] = "autoware_perception_msgs/TrackedObjectKinematics";
  static constexpr std::uint8_t kUnavailable = 0, kSignUnknown = 1, kAvailable = 2;
  PoseWithCovariance pose_with_covariance;
  TwistWithCovariance twist_with_covariance;  ///< twist in the object's frame
  AccelWithCovariance acceleration_with_covariance;
  std::uint8_t orientation_availability = kUnavailable;
  bool is_stationary = false;
  static void fields(auto& m, auto& a) {
    a("pose_with_covariance", m.pose_with_covariance);
    a("twist_with_covariance", m.twist_with_covariance);
    a("acceleration_with_covariance", m.acceleration_with_covariance);
    a("orientation_availability", m.orientation_availability);
    a("is_stationary", m.is_stationary);
  }
};

struct Shape {
  static constexpr char kType[] = "autoware_perception_msgs/Shape";
  static constexpr std::uint8_t kBoundingBox = 0;
  std::uint8_t type = kBoundingBox;
  Polygon footprint;
  Vector3 dimensions;
  static void fields(auto& m, auto& a) {
    a("type", m.type), a("footprint", m.footprint), a("dimensions", m.dimensions);
  }
};

struct TrackedObject {
  static constexpr char kType[] = "autoware_perception_msgs/TrackedObject";
  Uuid object_id;
  float existence_probability = 0;
  std::vector<ObjectClassification> classification;
  TrackedObjectKinematics kinematics;
  Shape shape;
  static void fields(auto& m, auto& a) {
    a("object_id", m.object_id), a("existence_probability", m.existence_probability);
    a("classification", m.classification), a("kinematics", m.kinematics), a("shape", m.shape);
  }
};

struct TrackedObjects {
  static constexpr char kType[] = "autoware_perception_msgs/TrackedObjects";
  Header header;
  std::vector<TrackedObject> objects;
  static void fields(auto& m, auto& a) { a("header", m.header), a("objects", m.objects); }
};

/// Confirmed objects in the frame `map`; T_MW is the pose of W in M. The last eight bytes of the
/// UUID are the id. Classes unknown to Autoware are UNKNOWN. Pose, covariance and size are those of
/// the most probable class. The sign of the orientation is marked as known only for moving objects.
/// If the σ of the yaw is above 1 rad, the orientation is marked as unavailable.
TrackedObjects trackedObjectsOf(const Objects& objects, const RigidTransform& T_MW);

}  // namespace perdure::ros::autoware
