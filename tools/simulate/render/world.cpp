#include "tools/simulate/render/world.h"

#include <array>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <tuple>

#include "tools/simulate/render/workers.h"

namespace perdure::tools {
namespace {

void* bufferOf(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::size_t stride,
               std::size_t count) {
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, stride, count);
  if (!buffer) throw std::runtime_error("there is not enough memory for the scene's triangles");
  return buffer;
}

/// Objects of equal class, shape, look and size share one surface.
using Look = std::tuple<std::string, std::string, std::uint64_t, std::array<double, 3>>;

Look lookOf(const sim::SceneObject& object) {
  return {object.class_name,
          object.shape,
          object.look_seed,
          {object.size.x(), object.size.y(), object.size.z()}};
}

std::shared_ptr<const Surface> sceneryOf(const sim::Scene& scene, Workers& workers) {
  std::vector<Mesh> meshes(scene.props.size() + 1);
  workers.run(meshes.size(), [&](std::size_t i) {
    meshes[i] = i == 0 ? makeGroundMesh(scene) : makePropMesh(scene.props[i - 1]);
  });
  auto surface = std::make_shared<Surface>();
  surface->add(meshes[0]);
  for (std::size_t i = 1; i < meshes.size(); ++i) {
    surface->add(meshes[i], scene.props[i - 1].T_WP);
  }
  return surface;
}

bool staysForGood(const sim::SceneObject& object) {
  constexpr double kForGood_s = 1e8;
  return !object.moves && object.present_from_s < -kForGood_s &&
         object.present_until_s > kForGood_s;
}

}  // namespace

World::World(const sim::Scene& scene, int threads)
    : scene_(scene), instances_(scene.objects.size() + 1), geometries_(scene.objects.size() + 1) {
  // One thread, because scheduling must not affect the order of the triangles. The order determines
  // which of two touching triangles a ray hits.
  device_ = rtcNewDevice("threads=1");
  if (!device_) throw std::runtime_error("Embree cannot start");
  makeSurfaces(threads);
  top_ = rtcNewScene(device_);
  rtcSetSceneFlags(top_, RTC_SCENE_FLAG_DYNAMIC);
  attachFixed();
  for (std::size_t i = 1; i < instances_.size(); ++i) {
    if (!staysForGood(scene_.objects[i - 1])) attachMoving(i);
  }
  setTime(0.0);
}

World::~World() {
  for (auto* geometry : geometries_) {
    if (geometry) rtcReleaseGeometry(geometry);
  }
  if (top_) rtcReleaseScene(top_);
  if (fixed_) rtcReleaseScene(fixed_);
  if (device_) rtcReleaseDevice(device_);
}

void World::makeSurfaces(int threads) {
  Workers workers(threads);
  instances_[0].surface = sceneryOf(scene_, workers);
  std::map<Look, std::size_t> known;
  std::vector<std::size_t> first;  // first object with each look
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    if (known.try_emplace(lookOf(scene_.objects[i]), i).second) first.push_back(i);
  }
  workers.run(first.size(), [&](std::size_t i) {
    auto surface = std::make_shared<Surface>();
    surface->add(makeObjectMesh(scene_.objects[first[i]]));
    instances_[first[i] + 1].surface = std::move(surface);
  });
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    const std::size_t same = known.at(lookOf(scene_.objects[i]));
    instances_[i + 1].surface = instances_[same + 1].surface;
    const RigidTransform T_WO = scene_.objects[i].motion.poseAt(0.0);
    instances_[i + 1].R = T_WO.R().cast<float>();
    instances_[i + 1].p = T_WO.p.cast<float>();
  }
}

RTCGeometry World::trianglesOf(const Surface& surface, const Instance& place) {
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* corners =
      static_cast<Eigen::Vector3f*>(bufferOf(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3,
                                             sizeof(Eigen::Vector3f), surface.positions.size()));
  for (const auto& position : surface.positions) *corners++ = place.R * position + place.p;
  void* indices = bufferOf(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3,
                           3 * sizeof(std::uint32_t), surface.triangles.size());
  std::memcpy(indices, surface.triangles.data(),
              surface.triangles.size() * 3 * sizeof(std::uint32_t));
  rtcCommitGeometry(geometry);
  return geometry;
}

/// Attaches the scenery and all static objects, each with the index of its instance.
void World::attachFixed() {
  fixed_ = rtcNewScene(device_);
  for (std::size_t i = 0; i < instances_.size(); ++i) {
    if (i > 0 && !staysForGood(scene_.objects[i - 1])) continue;
    RTCGeometry triangles = trianglesOf(*instances_[i].surface, instances_[i]);
    rtcAttachGeometryByID(fixed_, triangles, static_cast<unsigned>(i));
    rtcReleaseGeometry(triangles);
  }
  rtcCommitScene(fixed_);
  RTCGeometry all = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(all, fixed_);
  rtcCommitGeometry(all);
  rtcAttachGeometryByID(top_, all, 0);
  rtcReleaseGeometry(all);
}

void World::attachMoving(std::size_t index) {
  RTCGeometry triangles = trianglesOf(*instances_[index].surface, Instance{});
  RTCScene alone = rtcNewScene(device_);
  rtcAttachGeometry(alone, triangles);
  rtcReleaseGeometry(triangles);
  rtcCommitScene(alone);
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, alone);
  rtcReleaseScene(alone);  // the instance holds a reference
  rtcAttachGeometryByID(top_, geometry, static_cast<unsigned>(index));
  geometries_[index] = geometry;
  place(index);
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
    if (!moves(i + 1) || (time_s_ && !object.moves && present == instance.present)) continue;
    const sim::MotionState motion = object.motion.at(t_s);
    instance.R = motion.T_WB.R().cast<float>();
    instance.p = motion.T_WB.p.cast<float>();
    instance.velocity = motion.velocity_W.cast<float>();
    instance.turn_rate = (motion.T_WB.q * motion.angular_velocity_B).cast<float>();
    instance.moves = !instance.velocity.isZero() || !instance.turn_rate.isZero();
    instance.present = present;
    place(i + 1);
    changed = true;
  }
  if (changed) rtcCommitScene(top_);
  time_s_ = t_s;
  return changed;
}

void World::intersect(const int* valid, RTCRayHit8& rays) const {
  intersectCoherent(valid, top_, rays);
}

void World::occluded(const int* valid, RTCRay8& rays) const { occludedCoherent(valid, top_, rays); }

}  // namespace perdure::tools
