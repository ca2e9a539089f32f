#include "services/gateway/core/pieces.h"

namespace perdure::gateway {

std::string opticalFrame(const std::string& camera) { return camera + "_optical"; }

void put(JsonWriter& json, TimePoint time) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t ns = std::max<std::int64_t>(0, toNanoseconds(time));
  json.begin('{').with("sec", ns / kSecond).with("nsec", ns % kSecond).end('}');
}

void put(JsonWriter& json, const Eigen::Vector3d& v) {
  json.begin('{').with("x", v.x(), 3).with("y", v.y(), 3).with("z", v.z(), 3).end('}');
}

void put(JsonWriter& json, const Eigen::Quaterniond& q) {
  json.begin('{').with("x", q.x(), 6).with("y", q.y(), 6).with("z", q.z(), 6).with("w", q.w(), 6);
  json.end('}');
}

void put(JsonWriter& json, const RigidTransform& T) {
  json.begin('{').with("position", T.p).with("orientation", T.q).end('}');
}

void put(JsonWriter& json, const Colour& c) {
  json.begin('{').with("r", c.r, 3).with("g", c.g, 3).with("b", c.b, 3).with("a", c.a, 3).end('}');
}

void putDeletion(JsonWriter& json, TimePoint time, DeletionType type, const std::string& id) {
  json.begin('{').with("timestamp", time).with("type", static_cast<int>(type)).with("id", id);
  json.end('}');
}

void beginEntity(JsonWriter& json, TimePoint time, const char* frame, const std::string& id) {
  json.begin('{').with("timestamp", time).with("frame_id", frame).with("id", id).key("lifetime");
  json.raw(R"({"sec":0,"nsec":0})").with("frame_locked", true);
}

void endEntity(JsonWriter& json, std::initializer_list<const char*> without) {
  for (const char* none : without) json.key(none).begin('[').end(']');
  json.end('}');
}

void putSolid(JsonWriter& json, const char* name, const RigidTransform& pose,
              const Eigen::Vector3d& size, const Colour& colour) {
  json.key(name).begin('[').begin('{').with("pose", pose).with("size", size);
  json.with("color", colour).end('}').end(']');
}

void putLine(JsonWriter& json, LineType type, double thickness_px,
             const std::vector<Eigen::Vector3d>& points, const Colour& colour) {
  json.key("lines").begin('[').begin('{').with("type", static_cast<int>(type));
  json.with("pose", RigidTransform{}).with("thickness", thickness_px).with("scale_invariant", true);
  json.key("points").begin('[');
  for (const Eigen::Vector3d& point : points) put(json, point);
  json.end(']').with("color", colour).key("colors").begin('[').end(']').key("indices").begin('[');
  json.end(']').end('}').end(']');
}

void putPair(JsonWriter& json, const char* name, const std::string& value) {
  json.begin('{').with("key", name).with("value", value).end('}');
}

Eigen::Quaterniond rotationOfYaw(double yaw) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
}

}  // namespace perdure::gateway
