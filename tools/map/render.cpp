#include "tools/map/render.h"

#include <fmt/format.h>

#include <cmath>

#include "common/earth/geodesy.h"

namespace perdure::tools {
namespace {

using Json = nlohmann::ordered_json;

const char* nameOf(Memory memory) { return memory == Memory::kWorking ? "working" : "long_term"; }

Eigen::Vector3d sizeOf(const MapObject& object) { return object.mean.tail<3>().array().exp(); }

std::string deviation(const MapObject& object, int row, double scale = 1.0) {
  return fmt::format("{:.3f}", scale * std::sqrt(std::max(0.0, object.covariance(row, row))));
}

Json arrayOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

std::string toTable(const std::vector<MapObject>& objects) {
  std::string text =
      fmt::format("{:>6}  {:<14} {:>6} {:>6}  {:>9} {:>9} {:>8}  {:>5} {:>5} {:>5}  {:>5}  {}\n",
                  "id", "class", "exists", "class", "x", "y", "z", "l", "w", "h", "hits", "memory");
  for (const MapObject& o : objects) {
    const Eigen::Vector3d size = sizeOf(o);
    text += fmt::format(
        "{:>6}  {:<14} {:>6.3f} {:>6.3f}  {:>9.2f} {:>9.2f} {:>8.2f}  {:>5.2f} {:>5.2f} {:>5.2f}  "
        "{:>5}  {}{}\n",
        o.id, o.class_name, o.existence, o.class_probability, o.mean[0], o.mean[1], o.mean[2],
        size[0], size[1], size[2], o.hits, nameOf(o.memory), o.provisional ? ", provisional" : "");
  }
  return text;
}

std::string toText(const MapObject& o) {
  const Eigen::Vector3d size = sizeOf(o);
  return fmt::format(
      "object {}\n"
      "  class        {} ({:.3f})\n"
      "  existence    {:.3f}\n"
      "  position     {:.3f} {:.3f} {:.3f} m, sigma {} {} {}\n"
      "  yaw          {:.3f} rad, sigma {}\n"
      "  size         {:.3f} {:.3f} {:.3f} m, sigma {} {} {}\n"
      "  frame        world {}, epoch {}{}\n"
      "  first seen   {:.3f} s\n"
      "  last seen    {:.3f} s, {} times\n"
      "  now          {}, {} memory\n",
      o.id, o.class_name, o.class_probability, o.existence, o.mean[0], o.mean[1], o.mean[2],
      deviation(o, 0), deviation(o, 1), deviation(o, 2), o.mean[3], deviation(o, 3), size[0],
      size[1], size[2], deviation(o, 4, size[0]), deviation(o, 5, size[1]),
      deviation(o, 6, size[2]), o.world.world, o.world.epoch,
      o.provisional ? "; provisional: not found on the map of before" : "", toSeconds(o.first_seen),
      toSeconds(o.last_seen), o.hits, perdure::nameOf(o.visibility), nameOf(o.memory));
}

Json toJson(const MapObject& o) {
  Json mean = Json::array(), covariance = Json::array();
  for (int r = 0; r < 7; ++r) {
    mean.push_back(o.mean[r]);
    Json row = Json::array();
    for (int c = 0; c < 7; ++c) row.push_back(o.covariance(r, c));
    covariance.push_back(row);
  }
  return {{"id", o.id},
          {"class", o.class_name},
          {"existence", o.existence},
          {"probability", o.class_probability},
          {"position_m", arrayOf(o.mean.head<3>())},
          {"yaw_rad", o.mean[3]},
          {"size_m", arrayOf(sizeOf(o))},
          {"mean", mean},
          {"covariance", covariance},
          {"world", o.world.world},
          {"epoch", o.world.epoch},
          {"provisional", o.provisional},
          {"first_seen_ns", toNanoseconds(o.first_seen)},
          {"last_seen_ns", toNanoseconds(o.last_seen)},
          {"hits", o.hits},
          {"visibility", perdure::nameOf(o.visibility)},
          {"memory", nameOf(o.memory)}};
}

Json toGeoJson(const std::vector<MapObject>& objects, const std::optional<GeoAnchor>& anchor) {
  const GeoReference reference(anchor.value_or(GeoAnchor{}), RigidTransform());
  Json features = Json::array();
  for (const MapObject& o : objects) {
    const Geodetic g = reference(o.mean.head<3>());
    Json properties = toJson(o);
    properties["local_m"] = arrayOf(o.mean.head<3>());
    for (const char* key : {"id", "mean", "covariance", "position_m"}) properties.erase(key);
    features.push_back(
        {{"type", "Feature"},
         {"id", o.id},
         {"geometry",
          {{"type", "Point"}, {"coordinates", {g.longitude_deg, g.latitude_deg, g.height_m}}}},
         {"properties", properties}});
  }
  return {
      {"type", "FeatureCollection"}, {"georeferenced", anchor.has_value()}, {"features", features}};
}

}  // namespace perdure::tools
