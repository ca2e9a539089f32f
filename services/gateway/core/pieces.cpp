#include "services/gateway/core/pieces.h"

#include <cmath>

namespace perdure::gateway {

std::string opticalFrame(const std::string& camera) { return camera + "_optical"; }

void putTime(JsonWriter& json, TimePoint time) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t ns = std::max<std::int64_t>(0, toNanoseconds(time));
  json.begin('{').key("sec").integer(ns / kSecond).key("nsec").integer(ns % kSecond).end('}');
}

void putVector(JsonWriter& json, const Eigen::Vector3d& v) {
  json.begin('{').key("x").number(v.x()).key("y").number(v.y()).key("z").number(v.z()).end('}');
}

void putQuaternion(JsonWriter& json, const Eigen::Quaterniond& q) {
  json.begin('{').key("x").number(q.x(), 6).key("y").number(q.y(), 6);
  json.key("z").number(q.z(), 6).key("w").number(q.w(), 6).end('}');
}

void putPose(JsonWriter& json, const RigidTransform& T) {
  json.begin('{').key("position");
  putVector(json, T.p);
  json.key("orientation");
  putQuaternion(json, T.q);
  json.end('}');
}

void putColour(JsonWriter& json, const Colour& c) {
  json.begin('{').key("r").number(c.r, 3).key("g").number(c.g, 3);
  json.key("b").number(c.b, 3).key("a").number(c.a, 3).end('}');
}

void putNumbers(JsonWriter& json, std::span<const double> values, int decimals) {
  json.begin('[');
  for (const double value : values) json.number(value, decimals);
  json.end(']');
}

void putDeletion(JsonWriter& json, TimePoint time, DeletionType type, const std::string& id) {
  json.begin('{').key("timestamp");
  putTime(json, time);
  json.key("type").integer(static_cast<int>(type)).key("id").text(id).end('}');
}

void beginEntity(JsonWriter& json, TimePoint time, const char* frame, const std::string& id) {
  json.begin('{').key("timestamp");
  putTime(json, time);
  json.key("frame_id").text(frame).key("id").text(id);
  json.key("lifetime").raw(R"({"sec":0,"nsec":0})").key("frame_locked").boolean(true);
}

void endEntity(JsonWriter& json, std::initializer_list<const char*> without) {
  for (const char* none : without) json.key(none).begin('[').end(']');
  json.end('}');
}

void putPair(JsonWriter& json, const char* name, const std::string& value) {
  json.begin('{').key("key").text(name).key("value").text(value).end('}');
}

Eigen::Quaterniond rotationOfYaw(double yaw) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
}

}  // namespace perdure::gateway
