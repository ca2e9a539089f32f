#include "services/gateway/core/pieces.h"

#include <array>
#include <cmath>
#include <map>

#include "common/base/ids.h"

namespace perdure::gateway {
namespace {

constexpr Colour rgb(int r, int g, int b) { return {r / 255.0, g / 255.0, b / 255.0, 1.0}; }

}  // namespace

std::string opticalFrame(const std::string& camera) { return camera + "_optical"; }

Colour classColour(const std::string& class_name) {
  static const std::map<std::string, Colour> kKnown = {
      {"car", rgb(56, 142, 224)},     {"van", rgb(20, 180, 184)},
      {"truck", rgb(60, 110, 180)},   {"bus", rgb(110, 110, 220)},
      {"person", rgb(245, 140, 50)},  {"bicycle", rgb(80, 180, 90)},
      {"cyclist", rgb(80, 180, 90)},  {"motorcycle", rgb(175, 115, 65)},
      {"chair", rgb(150, 110, 225)},  {"dining table", rgb(185, 135, 85)},
      {"monitor", rgb(30, 170, 130)}, {"couch", rgb(225, 95, 85)},
      {"toy", rgb(225, 180, 40)},     {"other", rgb(150, 150, 150)}};
  static constexpr std::array<Colour, 6> kFurther = {rgb(150, 170, 60),  rgb(90, 150, 170),
                                                     rgb(205, 115, 105), rgb(120, 130, 190),
                                                     rgb(190, 160, 100), rgb(100, 170, 130)};
  const auto found = kKnown.find(class_name);
  return found != kKnown.end() ? found->second : kFurther[digest(class_name) % kFurther.size()];
}

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

Eigen::Quaterniond rotationOfYaw(double yaw) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
}

}  // namespace perdure::gateway
