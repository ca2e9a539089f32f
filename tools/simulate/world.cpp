#include "tools/simulate/world.h"

#include <array>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <tuple>

namespace perdure::tools {
namespace {

void* bufferOf(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::size_t stride,
               std::size_t count) {
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, stride, count);
  if (!buffer) throw std::runtime_error("there is not enough memory for the scene's triangles");
  return buffer;
}

/// Objects that look the same share one surface.
using Look = std::tuple<std::string, std::string, std::uint64_t, std::array<double, 3>>;

Look lookOf(const sim::SceneObject& object) {
  return {object.class_name,
          object.shape,
          object.look_seed,
          {object.size.x(), object.size.y(), object.size.z()}};
}

std::shared_ptr<const Surface> sceneryOf(const sim::Scene& scene) {
  auto surface = std::make_shared<Surface>();
  surface->add(makeGroundMesh(scene));
  for (const auto& prop : scene.props) surface->add(makePropMesh(prop), prop.T_WP);
  return surface;
}

}  // namespace

World::World(const sim::Scene& scene) : scene_(scene) {
  // One thread: the order of triangles, and with it which of two touching ones a ray meets, must
  // not depend on how a build was scheduled.
  device_ = rtcNewDevice("threads=1");
  if (!device_) throw std::runtime_error("Embree cannot start");
  top_ = rtcNewScene(device_);
  rtcSetSceneFlags(top_, RTC_SCENE_FLAG_DYNAMIC);
  const auto scenery = sceneryOf(scene_);
  addInstance(scenery, sceneOf(*scenery));
  std::map<Look, std::size_t> known;
  for (const auto& object : scene_.objects) {
    const auto [entry, is_new] = known.try_emplace(lookOf(object), instances_.size());
    if (is_new) {
      auto surface = std::make_shared<Surface>();
      surface->add(makeObjectMesh(object));
      addInstance(surface, sceneOf(*surface));
    } else {
      rtcRetainScene(inner_[entry->second]);
      addInstance(instances_[entry->second].surface, inner_[entry->second]);
    }
  }
  setTime(0.0);
}

World::~World() {
  for (auto* geometry : geometries_) rtcReleaseGeometry(geometry);
  for (auto* inner : inner_) rtcReleaseScene(inner);
  if (top_) rtcReleaseScene(top_);
  if (device_) rtcReleaseDevice(device_);
}

RTCScene World::sceneOf(const Surface& surface) {
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* corners = bufferOf(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3,
                           sizeof(Eigen::Vector3f), surface.positions.size());
  std::memcpy(corners, surface.positions.data(),
              surface.positions.size() * sizeof(Eigen::Vector3f));
  void* indices = bufferOf(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3,
                           3 * sizeof(std::uint32_t), surface.triangles.size());
  std::memcpy(indices, surface.triangles.data(),
              surface.triangles.size() * 3 * sizeof(std::uint32_t));
  rtcCommitGeometry(geometry);
  RTCScene inner = rtcNewScene(device_);
  rtcAttachGeometry(inner, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(inner);
  return inner;
}

void World::addInstance(std::shared_ptr<const Surface> surface, RTCScene inner) {
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, inner);
  rtcSetGeometryTimeStepCount(geometry, 1);
  rtcAttachGeometryByID(top_, geometry, static_cast<unsigned>(instances_.size()));
  geometries_.push_back(geometry);
  inner_.push_back(inner);
  instances_.emplace_back().surface = std::move(surface);
  place(instances_.size() - 1);
}

void World::place(std::size_t index) {
  const Instance& instance = instances_[index];
  Eigen::Matrix<float, 3, 4> transform;
  transform << instance.R, instance.p;
  RTCGeometry geometry = geometries_[index];
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform.data());
  instance.present ? rtcEnableGeometry(geometry) : rtcDisableGeometry(geometry);
  rtcCommitGeometry(geometry);
}

bool World::setTime(double t_s) {
  bool changed = !time_s_;
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    const sim::SceneObject& object = scene_.objects[i];
    Instance& instance = instances_[i + 1];
    const bool present = object.presentAt(t_s);
    if (time_s_ && !object.moves && present == instance.present) continue;
    const sim::MotionState motion = object.motion.at(t_s);
    instance.R = motion.T_WB.R().cast<float>();
    instance.p = motion.T_WB.p.cast<float>();
    instance.velocity = motion.velocity_W.cast<float>();
    instance.turn_rate = (motion.T_WB.q * motion.angular_velocity_B).cast<float>();
    instance.present = present;
    place(i + 1);
    changed = true;
  }
  if (changed) rtcCommitScene(top_);
  time_s_ = t_s;
  return changed;
}

void World::intersect(const int* valid, RTCRayHit8& rays) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid, top_, &context, &rays);
}

void World::occluded(const int* valid, RTCRay8& rays) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded8(valid, top_, &context, &rays);
}

}  // namespace perdure::tools
