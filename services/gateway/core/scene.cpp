#include "services/gateway/core/scene.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/types/cuboid.h"
#include "services/gateway/core/pieces.h"

namespace perdure::gateway {
namespace {

constexpr int kTold = 100;
constexpr double kEllipsoidSigmas = 2.0;

double opacityOf(const ObjectBelief& object) {
  return isInSight(object) ? 0.9 : isHidden(object) ? 0.8 : 0.35;
}

void putCube(JsonWriter& json, const ObjectBelief& object, const Cuboid& cuboid) {
  json.key("cubes").begin('[');
  if (isInSight(object)) {
    json.begin('{').key("pose");
    putPose(json, cuboid.T_WO);
    json.key("size");
    putVector(json, cuboid.size);
    json.key("color");
    putColour(json, classColour(object.best().name).withAlpha(0.35 * object.existence));
    json.end('}');
  }
  json.end(']');
}

struct EdgeLook {
  double thickness = 1;  ///< px
  bool dashed = false;
  Colour colour;
};

void putEdges(JsonWriter& json, const Cuboid& cuboid, const EdgeLook& look) {
  json.key("lines").begin('[').begin('{').key("type").integer(
      static_cast<int>(LineType::kSegments));
  json.key("pose");
  putPose(json, {});
  json.key("thickness").number(look.thickness).key("scale_invariant").boolean(true);
  json.key("points").begin('[');
  for (const Eigen::Vector3d& end : strokesOf(cuboid, look.dashed)) putVector(json, end);
  json.end(']').key("color");
  putColour(json, look.colour);
  json.key("colors").begin('[').end(']').key("indices").begin('[').end(']');
  json.end('}').end(']');
}

void putEllipsoid(JsonWriter& json, const ObjectBelief& object) {
  const Eigen::Matrix3d P = object.best().covariance.topLeftCorner<3, 3>();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(P);
  Eigen::Matrix3d axes = eigen.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1;
  const Eigen::Vector3d radii = kEllipsoidSigmas * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  json.key("spheres").begin('[').begin('{').key("pose");
  putPose(json, RigidTransform(axes, Eigen::Vector3d(object.best().mean.head<3>())));
  json.key("size");
  putVector(json, 2 * radii);
  json.key("color");
  putColour(json, {1, 1, 1, 0.25});
  json.end('}').end(']');
}

void putLabel(JsonWriter& json, const Cuboid& cuboid, const std::string& text, double opacity) {
  constexpr double kAbove = 0.3;  // m
  const Eigen::Vector3d up = cuboid.T_WO.q * Eigen::Vector3d::UnitZ();
  json.key("texts").begin('[').begin('{').key("pose");
  putPose(json, {Eigen::Quaterniond::Identity(),
                 Eigen::Vector3d(cuboid.T_WO.p + up * (cuboid.size.z() / 2 + kAbove))});
  json.key("billboard").boolean(true).key("font_size").number(12);
  json.key("scale_invariant").boolean(true).key("color");
  putColour(json, {1, 1, 1, opacity});
  json.key("text").text(text);
  json.end('}').end(']');
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
  putCube(json, object, cuboid);
  putEdges(json, cuboid,
           {isInSight(object) ? 2 : 1.5, isHidden(object),
            classColour(object.best().name).withAlpha(opacityOf(object))});
  putEllipsoid(json, object);
  putLabel(json, cuboid, nameOf(object) + (isHidden(object) ? " (hidden)" : ""), opacityOf(object));
  endEntity(json, {"arrows", "cylinders", "triangles", "models"});
}

void putEntity(JsonWriter& json, TimePoint time, const MapObject& object) {
  constexpr double kFaint = 0.3, kFaintest = 0.1;
  const Eigen::Quaterniond yaw(Eigen::AngleAxisd(object.mean[3], Eigen::Vector3d::UnitZ()));
  const Cuboid cuboid{RigidTransform(yaw, Eigen::Vector3d(object.mean.head<3>())),
                      object.mean.tail<3>().array().exp().matrix()};
  const Colour colour = classColour(object.class_name);
  beginEntity(json, time, kMapFrame, "map " + std::to_string(object.id));
  json.key("metadata").begin('[');
  putPair(json, "exists", percent(object.existence));
  putPair(json, object.class_name.c_str(), percent(object.class_probability));
  if (object.provisional) putPair(json, "provisional", "its session is not found on the map yet");
  json.end(']').key("cubes").begin('[').begin('{').key("pose");
  putPose(json, cuboid.T_WO);
  json.key("size");
  putVector(json, cuboid.size);
  json.key("color");
  putColour(json, colour.withAlpha(kFaintest));
  json.end('}').end(']');
  putEdges(json, cuboid, {1, object.provisional, colour.withAlpha(kFaint)});
  const std::string name = object.class_name + " " + std::to_string(object.id);
  putLabel(json, cuboid, name + (object.provisional ? " (provisional)" : ""), kFaint);
  endEntity(json, {"spheres", "arrows", "cylinders", "triangles", "models"});
}

}  // namespace

std::string Scene::update(const Objects& objects) {
  if (world_ != objects.world) {
    world_ = objects.world;
    shown_.clear();
    gone_.clear();
    clear_ = kTold;
  }
  JsonWriter json(4096 + 3072 * objects.objects.size());
  std::set<ObjectId> now;
  for (const ObjectBelief& object : objects.objects) {
    if (object.confirmed) now.insert(object.id);
  }
  for (const ObjectId id : shown_) {
    if (!now.contains(id)) gone_.push_back({id, 0});
  }
  std::erase_if(gone_, [&](const Gone& one) { return one.told >= kTold || now.contains(one.id); });
  json.begin('{').key("deletions").begin('[');
  if (clear_ > 0) {
    --clear_;
    putDeletion(json, objects.stamp.time, DeletionType::kAll, "");
  }
  for (Gone& one : gone_) {
    ++one.told;
    putDeletion(json, objects.stamp.time, DeletionType::kMatching, std::to_string(one.id));
  }
  json.end(']').key("entities").begin('[');
  for (const ObjectBelief& object : objects.objects) {
    if (object.confirmed) putEntity(json, objects, object);
  }
  json.end(']').end('}');
  shown_ = std::move(now);
  return json.take();
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
