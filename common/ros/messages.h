// ROS messages as structs, with the names and field order of ROS 2. Each lists its fields once, for
// CDR, ROS 1 bytes, and the text of the definition.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/shared_bytes.h"

namespace perdure::ros {

struct Time {
  static constexpr char kType[] = "builtin_interfaces/Time";
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  static void fields(auto& m, auto& a) { a("sec", m.sec), a("nanosec", m.nanosec); }
};

struct Duration {
  static constexpr char kType[] = "builtin_interfaces/Duration";
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  static void fields(auto& m, auto& a) { a("sec", m.sec), a("nanosec", m.nanosec); }
};

struct Header {
  static constexpr char kType[] = "std_msgs/Header";
  Time stamp;
  std::string frame_id;
  static void fields(auto& m, auto& a) { a("stamp", m.stamp), a("frame_id", m.frame_id); }
};

struct ColorRGBA {
  static constexpr char kType[] = "std_msgs/ColorRGBA";
  float r = 0, g = 0, b = 0, a = 0;
  static void fields(auto& m, auto& to) { to("r", m.r), to("g", m.g), to("b", m.b), to("a", m.a); }
};

struct Point {
  static constexpr char kType[] = "geometry_msgs/Point";
  double x = 0, y = 0, z = 0;
  static void fields(auto& m, auto& a) { a("x", m.x), a("y", m.y), a("z", m.z); }
};

struct Vector3 {
  static constexpr char kType[] = "geometry_msgs/Vector3";
  double x = 0, y = 0, z = 0;
  static void fields(auto& m, auto& a) { a("x", m.x), a("y", m.y), a("z", m.z); }
};

struct Quaternion {
  static constexpr char kType[] = "geometry_msgs/Quaternion";
  double x = 0, y = 0, z = 0, w = 1;
  static void fields(auto& m, auto& a) { a("x", m.x), a("y", m.y), a("z", m.z), a("w", m.w); }
};

struct Pose {
  static constexpr char kType[] = "geometry_msgs/Pose";
  Point position;
  Quaternion orientation;
  static void fields(auto& m, auto& a) {
    a("position", m.position), a("orientation", m.orientation);
  }
};

struct PoseWithCovariance {
  static constexpr char kType[] = "geometry_msgs/PoseWithCovariance";
  Pose pose;
  std::array<double, 36> covariance{};  ///< row by row: x, y, z, about x, about y, about z
  static void fields(auto& m, auto& a) { a("pose", m.pose), a("covariance", m.covariance); }
};

struct Twist {
  static constexpr char kType[] = "geometry_msgs/Twist";
  Vector3 linear, angular;
  static void fields(auto& m, auto& a) { a("linear", m.linear), a("angular", m.angular); }
};

struct TwistWithCovariance {
  static constexpr char kType[] = "geometry_msgs/TwistWithCovariance";
  Twist twist;
  std::array<double, 36> covariance{};
  static void fields(auto& m, auto& a) { a("twist", m.twist), a("covariance", m.covariance); }
};

struct Transform {
  static constexpr char kType[] = "geometry_msgs/Transform";
  Vector3 translation;
  Quaternion rotation;
  static void fields(auto& m, auto& a) {
    a("translation", m.translation), a("rotation", m.rotation);
  }
};

struct TransformStamped {
  static constexpr char kType[] = "geometry_msgs/TransformStamped";
  Header header;
  std::string child_frame_id;
  Transform transform;  ///< transform from the child's frame into the header's frame
  static void fields(auto& m, auto& a) {
    a("header", m.header), a("child_frame_id", m.child_frame_id), a("transform", m.transform);
  }
};

struct TFMessage {
  static constexpr char kType[] = "tf2_msgs/TFMessage";
  std::vector<TransformStamped> transforms;
  static void fields(auto& m, auto& a) { a("transforms", m.transforms); }
};

struct RegionOfInterest {
  static constexpr char kType[] = "sensor_msgs/RegionOfInterest";
  std::uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;
  bool do_rectify = false;
  static void fields(auto& m, auto& a) {
    a("x_offset", m.x_offset), a("y_offset", m.y_offset), a("height", m.height);
    a("width", m.width), a("do_rectify", m.do_rectify);
  }
};

struct CameraInfo {
  static constexpr char kType[] = "sensor_msgs/CameraInfo";
  Header header;
  std::uint32_t height = 0, width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0;
  RegionOfInterest roi;
  static void fields(auto& m, auto& a) {
    a("header", m.header), a("height", m.height), a("width", m.width);
    a("distortion_model", m.distortion_model), a("d", m.d), a("k", m.k), a("r", m.r);
    a("p", m.p), a("binning_x", m.binning_x), a("binning_y", m.binning_y), a("roi", m.roi);
  }
};

struct Image {
  static constexpr char kType[] = "sensor_msgs/Image";
  Header header;
  std::uint32_t height = 0, width = 0;
  std::string encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;  ///< bytes per row
  SharedBytes data;
  static void fields(auto& m, auto& a) {
    a("header", m.header), a("height", m.height), a("width", m.width), a("encoding", m.encoding);
    a("is_bigendian", m.is_bigendian), a("step", m.step), a("data", m.data);
  }
};

struct CompressedImage {
  static constexpr char kType[] = "sensor_msgs/CompressedImage";
  Header header;
  std::string format;
  SharedBytes data;
  static void fields(auto& m, auto& a) {
    a("header", m.header), a("format", m.format), a("data", m.data);
  }
};

struct Imu {
  static constexpr char kType[] = "sensor_msgs/Imu";
  Header header;
  Quaternion orientation;
  std::array<double, 9> orientation_covariance{};  ///< [0] = -1: no orientation
  Vector3 angular_velocity;
  std::array<double, 9> angular_velocity_covariance{};
  Vector3 linear_acceleration;  ///< specific force
  std::array<double, 9> linear_acceleration_covariance{};
  static void fields(auto& m, auto& a) {
    a("header", m.header), a("orientation", m.orientation);
    a("orientation_covariance", m.orientation_covariance);
    a("angular_velocity", m.angular_velocity);
    a("angular_velocity_covariance", m.angular_velocity_covariance);
    a("linear_acceleration", m.linear_acceleration);
    a("linear_acceleration_covariance", m.linear_acceleration_covariance);
  }
};

struct Clock {
  static constexpr char kType[] = "rosgraph_msgs/Clock";
  Time clock;
  static void fields(auto& m, auto& a) { a("clock", m.clock); }
};

struct PointField {
  static constexpr char kType[] = "sensor_msgs/PointField";
  static constexpr std::uint8_t kFloat32 = 7;
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = kFloat32;
  std::uint32_t count = 1;
  static void fields(auto& m, auto& a) {
    a("name", m.name), a("offset", m.offset), a("datatype", m.datatype), a("count", m.count);
  }
};

struct PointCloud2 {
  static constexpr char kType[] = "sensor_msgs/PointCloud2";
  using PointFields = std::vector<PointField>;
  Header header;
  std::uint32_t height = 1, width = 0;
  PointFields point_fields;  ///< has the name `fields` in ROS
  bool is_bigendian = false;
  std::uint32_t point_step = 0, row_step = 0;
  SharedBytes data;
  bool is_dense = true;
  static void fields(auto& m, auto& a) {
    a("header", m.header), a("height", m.height), a("width", m.width);
    a("fields", m.point_fields), a("is_bigendian", m.is_bigendian);
    a("point_step", m.point_step), a("row_step", m.row_step), a("data", m.data);
    a("is_dense", m.is_dense);
  }
};

struct Odometry {
  static constexpr char kType[] = "nav_msgs/Odometry";
  Header header;
  std::string child_frame_id;
  PoseWithCovariance pose;
  TwistWithCovariance twist;  ///< twist in the child's frame
  static void fields(auto& m, auto& a) {
    a("header", m.header), a("child_frame_id", m.child_frame_id);
    a("pose", m.pose), a("twist", m.twist);
  }
};

struct ObjectHypothesis {
  static constexpr char kType[] = "vision_msgs/ObjectHypothesis";
  std::string class_id;
  double score = 0;
  static void fields(auto& m, auto& a) { a("class_id", m.class_id), a("score", m.score); }
};

struct ObjectHypothesisWithPose {
  static constexpr char kType[] = "vision_msgs/ObjectHypothesisWithPose";
  ObjectHypothesis hypothesis;
  PoseWithCovariance pose;
  static void fields(auto& m, auto& a) { a("hypothesis", m.hypothesis), a("pose", m.pose); }
};

struct Point2D {
  static constexpr char kType[] = "vision_msgs/Point2D";
  double x = 0, y = 0;
  static void fields(auto& m, auto& a) { a("x", m.x), a("y", m.y); }
};

struct Pose2D {
  static constexpr char kType[] = "vision_msgs/Pose2D";
  Point2D position;
  double theta = 0;
  static void fields(auto& m, auto& a) { a("position", m.position), a("theta", m.theta); }
};

struct BoundingBox2D {
  static constexpr char kType[] = "vision_msgs/BoundingBox2D";
  Pose2D center;
  double size_x = 0, size_y = 0;
  static void fields(auto& m, auto& a) {
    a("center", m.center), a("size_x", m.size_x), a("size_y", m.size_y);
  }
};

struct Detection2D {
  static constexpr char kType[] = "vision_msgs/Detection2D";
  Header header;
  std::vector<ObjectHypothesisWithPose> results;
  BoundingBox2D bbox;
  std::string id;
  static void fields(auto& m, auto& a) {
    a("header", m.header), a("results", m.results), a("bbox", m.bbox), a("id", m.id);
  }
};

struct Detection2DArray {
  static constexpr char kType[] = "vision_msgs/Detection2DArray";
  Header header;
  std::vector<Detection2D> detections;
  static void fields(auto& m, auto& a) { a("header", m.header), a("detections", m.detections); }
};

struct BoundingBox3D {
  static constexpr char kType[] = "vision_msgs/BoundingBox3D";
  Pose center;
  Vector3 size;
  static void fields(auto& m, auto& a) { a("center", m.center), a("size", m.size); }
};

struct Detection3D {
  static constexpr char kType[] = "vision_msgs/Detection3D";
  Header header;
  std::vector<ObjectHypothesisWithPose> results;
  BoundingBox3D bbox;
  std::string id;
  static void fields(auto& m, auto& a) {
    a("header", m.header), a("results", m.results), a("bbox", m.bbox), a("id", m.id);
  }
};

struct Detection3DArray {
  static constexpr char kType[] = "vision_msgs/Detection3DArray";
  Header header;
  std::vector<Detection3D> detections;
  static void fields(auto& m, auto& a) { a("header", m.header), a("detections", m.detections); }
};

struct UVCoordinate {
  static constexpr char kType[] = "visualization_msgs/UVCoordinate";
  float u = 0, v = 0;
  static void fields(auto& m, auto& a) { a("u", m.u), a("v", m.v); }
};

struct MeshFile {
  static constexpr char kType[] = "visualization_msgs/MeshFile";
  std::string filename;
  SharedBytes data;
  static void fields(auto& m, auto& a) { a("filename", m.filename), a("data", m.data); }
};

struct Marker {
  static constexpr char kType[] = "visualization_msgs/Marker";
  enum Shape : std::int32_t { kCube = 1, kSphere = 2, kLineList = 5, kText = 9 };
  enum Action : std::int32_t { kAdd = 0, kDelete = 2, kDeleteAll = 3 };
  Header header;
  std::string ns;
  std::int32_t id = 0, type = kCube, action = kAdd;
  Pose pose;
  Vector3 scale;
  ColorRGBA color;
  Duration lifetime;  ///< 0: the marker remains until it is deleted
  bool frame_locked = false;
  std::vector<Point> points;
  std::vector<ColorRGBA> colors;
  std::string texture_resource;
  CompressedImage texture;
  std::vector<UVCoordinate> uv_coordinates;
  std::string text, mesh_resource;
  MeshFile mesh_file;
  bool mesh_use_embedded_materials = false;
  static void fields(auto& m, auto& a) {
    a("header", m.header), a("ns", m.ns), a("id", m.id), a("type", m.type);
    a("action", m.action), a("pose", m.pose), a("scale", m.scale), a("color", m.color);
    a("lifetime", m.lifetime), a("frame_locked", m.frame_locked), a("points", m.points);
    a("colors", m.colors), a("texture_resource", m.texture_resource), a("texture", m.texture);
    a("uv_coordinates", m.uv_coordinates), a("text", m.text);
    a("mesh_resource", m.mesh_resource), a("mesh_file", m.mesh_file);
    a("mesh_use_embedded_materials", m.mesh_use_embedded_materials);
  }
};

struct MarkerArray {
  static constexpr char kType[] = "visualization_msgs/MarkerArray";
  std::vector<Marker> markers;
  static void fields(auto& m, auto& a) { a("markers", m.markers); }
};

struct KeyValue {
  static constexpr char kType[] = "diagnostic_msgs/KeyValue";
  std::string key, value;
  static void fields(auto& m, auto& a) { a("key", m.key), a("value", m.value); }
};

struct DiagnosticStatus {
  static constexpr char kType[] = "diagnostic_msgs/DiagnosticStatus";
  enum Level : std::uint8_t { kOk = 0, kWarn = 1, kError = 2, kStale = 3 };
  std::byte level{kOk};
  std::string name, message, hardware_id;
  std::vector<KeyValue> values;
  static void fields(auto& m, auto& a) {
    a("level", m.level), a("name", m.name), a("message", m.message);
    a("hardware_id", m.hardware_id), a("values", m.values);
  }
};

struct DiagnosticArray {
  static constexpr char kType[] = "diagnostic_msgs/DiagnosticArray";
  Header header;
  std::vector<DiagnosticStatus> status;
  static void fields(auto& m, auto& a) { a("header", m.header), a("status", m.status); }
};

}  // namespace perdure::ros
