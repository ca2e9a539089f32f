#include "services/gateway/core/scene.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/types/cuboid.h"
#include "services/gateway/core/pieces.h"

namespace perdure::gateway {
namespace {

constexpr double kEllipsoidSigmas = 2.0;

/// Returns an entity's JSON without the time at the beginning.
std::string_view untimed(std::string_view entity) {
  return entity.substr(std::min(entity.size(), entity.find("frame_id")));
}

double opacityOf(const ObjectBelief& object) {
  return isInSight(object) ? 0.9 : isHidden(object) ? 0.8 : 0.35;
}

void putEllipsoid(JsonWriter& json, const ObjectBelief& object) {
  const Eigen::Matrix3d P = object.best().covariance.topLeftCorner<3, 3>();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(P);
  Eigen::Matrix3d axes = eigen.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1;
  const Eigen::Vector3d radii = kEllipsoidSigmas * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const Eigen::Vector3d size_cm = (200.0 * radii).array().round();  // few changes between frames
  putSolid(json, "spheres", {axes, Eigen::Vector3d(object.best().mean.head<3>())}, size_cm / 100.0,
           {1, 1, 1, 0.25});
}

void putLabel(JsonWriter& json, const Cuboid& cuboid, const std::string& text, double opacity) {
  constexpr double kAbove = 0.3;  // m
  const Eigen::Vector3d up = cuboid.T_WO.q * Eigen::Vector3d::UnitZ();
  json.key("texts").begin('[').begin('{');
  json.with("pose",
            RigidTransform{Eigen::Quaterniond::Identity(),
                           Eigen::Vector3d(cuboid.T_WO.p + up * (cuboid.size.z() / 2 + kAbove))});
  json.with("billboard", true).with("font_size", 12).with("scale_invariant", true);
  json.with("color", Colour{1, 1, 1, opacity}).with("text", text).end('}').end(']');
}

std::string percent(double probability) {
  return std::to_string(static_cast<int>(std::lround(100 * probability))) + " %";
}

void putMetadata(JsonWriter& json, const ObjectBelief& object) {
  json.key("metadata").begin('[');
  putPair(json, "exists", percent(object.existence));
  for (const ClassBelief& belief : object.classes) {
    putPair(json, belief.name.c_str(), percent(belief.probability));
  }
  putPair(json, "visibility", perdure::nameOf(object.visibility));
  if (object.blocked_by != 0) putPair(json, "hidden by", std::to_string(object.blocked_by));
  json.end(']');
}

void putEntity(JsonWriter& json, const Objects& objects, const ObjectBelief& object) {
  const Cuboid cuboid = cuboidOf(object, objects.up_W);
  beginEntity(json, objects.stamp.time, kOdomFrame, std::to_string(object.id));
  putMetadata(json, object);
  const Colour colour = classColour(object.best().name);
  if (isInSight(object)) {
    putSolid(json, "cubes", cuboid.T_WO, cuboid.size, colour.withAlpha(0.35 * object.existence));
  } else {
    json.key("cubes").begin('[').end(']');
  }
  putLine(json, LineType::kSegments, isInSight(object) ? 2 : 1.5,
          strokesOf(cuboid, isHidden(object)), colour.withAlpha(opacityOf(object)));
  putEllipsoid(json, object);
  putLabel(json, cuboid, nameOf(object) + (isHidden(object) ? " (hidden)" : ""), opacityOf(object));
  endEntity(json, {"arrows", "cylinders", "triangles", "models"});
}

void putEntity(JsonWriter& json, TimePoint time, const MapObject& object) {
  constexpr double kFaint = 0.3, kFaintest = 0.1;
  const Cuboid cuboid{{rotationOfYaw(object.mean[3]), Eigen::Vector3d(object.mean.head<3>())},
                      object.mean.tail<3>().array().exp().matrix()};
  const Colour colour = classColour(object.class_name);
  beginEntity(json, time, kMapFrame, "map " + std::to_string(object.id));
  json.key("metadata").begin('[');
  putPair(json, "exists", percent(object.existence));
  putPair(json, object.class_name.c_str(), percent(object.class_probability));
  if (object.provisional) putPair(json, "provisional", "its session is not found on the map yet");
  json.end(']');
  putSolid(json, "cubes", cuboid.T_WO, cuboid.size, colour.withAlpha(kFaintest));
  putLine(json, LineType::kSegments, 1, strokesOf(cuboid, object.provisional),
          colour.withAlpha(kFaint));
  const std::string name = object.class_name + " " + std::to_string(object.id);
  putLabel(json, cuboid, name + (object.provisional ? " (provisional)" : ""), kFaint);
  endEntity(json, {"spheres", "arrows", "cylinders", "triangles", "models"});
}

}  // namespace

SceneUpdate Scene::update(const Objects& objects) {
  const TimePoint time = objects.stamp.time;
  if (std::exchange(world_, objects.world) != objects.world) shown_.clear();
  const bool begins = shown_.empty();
  std::map<ObjectId, std::string> now;
  JsonWriter changes(4096), whole(4096 + 3072 * objects.objects.size());
  whole.begin('{').key("deletions").begin('[');
  putDeletion(whole, time, DeletionType::kAll, "");
  whole.end(']').key("entities").begin('[');
  changes.begin('{').key("entities").begin('[');
  for (const ObjectBelief& object : objects.objects) {
    if (!object.confirmed) continue;
    JsonWriter entity(4096);
    putEntity(entity, objects, object);
    std::string& text = now[object.id] = entity.take();
    auto before = shown_.extract(object.id);
    if (before && untimed(before.mapped()) == untimed(text)) {
      text = std::move(before.mapped());
    } else {
      changes.raw(text);
    }
    whole.raw(text);
  }
  changes.end(']').key("deletions").begin('[');
  for (const auto& [id, gone] : shown_)
    putDeletion(changes, time, DeletionType::kMatching, std::to_string(id));
  shown_ = std::move(now);
  std::string all = whole.end(']').end('}').take();
  return {begins ? all : changes.end(']').end('}').take(), std::move(all)};
}

std::string mapScene(const std::vector<MapObject>& objects, const std::set<ObjectId>& working,
                     TimePoint time) {
  JsonWriter json(1024 + 2048 * objects.size());
  json.begin('{').key("deletions").begin('[');
  putDeletion(json, time, DeletionType::kAll, "");
  json.end(']').key("entities").begin('[');
  for (const MapObject& object : objects) {
    if (!working.contains(object.id)) putEntity(json, time, object);
  }
  return json.end(']').end('}').take();
}

}  // namespace perdure::gateway
