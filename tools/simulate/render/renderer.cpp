#include "tools/simulate/render/renderer.h"

#include <algorithm>
#include <limits>

#include "common/math/so3.h"

namespace perdure::tools {
namespace {

constexpr float kRayStart = 0.02F, kSunOffset = 2e-3F;

/// Mask of a packet: -1 for active lanes; aligned as Embree requires.
struct alignas(32) Lanes {
  std::array<int, kPacket> valid{};
};

template <class Rays>
void setRay(Rays& rays, unsigned i, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
            float near) {
  rays.org_x[i] = origin.x(), rays.org_y[i] = origin.y(), rays.org_z[i] = origin.z();
  rays.dir_x[i] = direction.x(), rays.dir_y[i] = direction.y(), rays.dir_z[i] = direction.z();
  rays.tnear[i] = near;
  rays.tfar[i] = std::numeric_limits<float>::infinity();
  rays.time[i] = 0.0F;
  rays.mask[i] = ~0U, rays.id[i] = i, rays.flags[i] = 0;
}

void readHit(const World& world, const RTCRayHit8& rays, unsigned i, const Eigen::Vector3f& origin,
             const Eigen::Vector3f& direction, Hit& hit) {
  hit.instance = World::instanceOf(rays, i);
  if (hit.instance == kNothing) return;
  const Instance& instance = world.instances()[hit.instance];
  const SurfacePoint point =
      pointOn(*instance.surface, rays.hit.primID[i], rays.hit.u[i], rays.hit.v[i]);
  hit.material = point.material_index;
  hit.surface = point.material;
  hit.uv = point.uv;
  hit.repeats_per_metre = point.repeats_per_metre;
  hit.distance = rays.ray.tfar[i];
  hit.position = origin + hit.distance * direction;
  hit.normal = (instance.R * point.normal).normalized();
  if (hit.normal.dot(direction) > 0.0F) {
    // The normal may point away for a back face, or for the shading normal of a rounded edge. Only
    // back faces are flipped.
    Eigen::Vector3f flat(rays.hit.Ng_x[i], rays.hit.Ng_y[i], rays.hit.Ng_z[i]);
    if (World::movesAlone(rays, i)) flat = instance.R * flat;
    if (flat.dot(hit.normal) * flat.dot(direction) > 0.0F) hit.normal = -hit.normal;
  }
}

}  // namespace

Shot shotAt(const sim::Scene& scene, std::size_t camera, double time_s) {
  const CameraCalibration& calibration = scene.rig.true_calibration.cameras.at(camera);
  Shot shot;
  shot.time_s = time_s;
  shot.body = scene.body.at(time_s);
  shot.T_BC = calibration.T_BC;
  shot.exposure_s = scene.rig.cameras.at(camera).exposure_s;
  shot.readout_s = calibration.readout_s;
  return shot;
}

Renderer::Renderer(World& world, Workers& workers)
    : world_(world), workers_(workers), lighting_(world.scene()) {
  lighting_.setTime(world_);
}

void Renderer::begin(const Lens& lens, const Shot& shot, Picture& picture, int step) {
  lens_ = &lens;
  if (world_.setTime(shot.time_s)) lighting_.setTime(world_);
  picture.width = (lens.width() + step - 1) / step;
  picture.height = (lens.height() + step - 1) / step;
  picture.instance.resize(picture.index(0, picture.height));
  const RigidTransform T_WC = shot.body.T_WB * shot.T_BC;
  const Eigen::Vector3d turn_W = shot.body.T_WB.q * shot.body.angular_velocity_B;
  const Eigen::Vector3d velocity_W =
      shot.body.velocity_W + turn_W.cross(shot.body.T_WB.q * shot.T_BC.p);
  eyes_.clear();
  const int rows = shot.readout_s > 0.0 ? lens.height() : 1;
  for (int row = 0; row < rows; ++row) {
    const double t = rows > 1 ? shot.readout_s * (row / (rows - 1.0) - 0.5) : 0.0;
    eyes_.push_back({(expQuaternion(turn_W * t) * T_WC.q).toRotationMatrix().cast<float>(),
                     (T_WC.p + t * velocity_W).cast<float>()});
  }
  R_CW_ = T_WC.R().transpose().cast<float>();
  eye_velocity_C_ = R_CW_ * velocity_W.cast<float>();
  turn_rate_C_ = R_CW_ * turn_W.cast<float>();
  exposure_s_ = static_cast<float>(shot.exposure_s);
}

void Renderer::aim(Packet& packet, int column, int row, float dx, float dy) const {
  const Eye& eye = eyes_[eyes_.size() > 1 ? static_cast<std::size_t>(row) : 0];
  packet.origins[packet.count] = eye.p;
  const bool centre = dx == 0.0F && dy == 0.0F;
  packet.directions[packet.count] =
      eye.R * (centre ? lens_->direction(column, row) : lens_->direction(column, row, dx, dy));
  ++packet.count;
}

void Renderer::follow(Packet& packet) const {
  RTCRayHit8 rays;
  Lanes lanes;
  for (unsigned i = 0; i < packet.count; ++i) {
    lanes.valid[i] = -1;
    setRay(rays.ray, i, packet.origins[i], packet.directions[i], kRayStart);
    rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  world_.intersect(lanes.valid.data(), rays);
  for (unsigned i = 0; i < packet.count; ++i) {
    readHit(world_, rays, i, packet.origins[i], packet.directions[i], packet.hits[i]);
  }
}

void Renderer::findSun(Packet& packet) const {
  RTCRay8 rays;
  Lanes lanes;
  bool any = false;
  for (unsigned i = 0; i < packet.count; ++i) {
    const Hit& hit = packet.hits[i];
    packet.in_sun[i] = false;
    if (hit.instance == kNothing || hit.normal.dot(lighting_.sun()) <= 0.0F) continue;
    const float offset = kSunOffset + 2e-4F * hit.distance;
    setRay(rays, i, hit.position + offset * hit.normal, lighting_.sun(), offset);
    lanes.valid[i] = -1;
    any = true;
  }
  if (!any) return;
  world_.occluded(lanes.valid.data(), rays);
  for (unsigned i = 0; i < packet.count; ++i)
    packet.in_sun[i] = lanes.valid[i] && rays.tfar[i] >= 0.0F;
}

void Renderer::forTiles(const Picture& picture, const std::function<void(int, int)>& task) {
  const int columns = (picture.width + kTile - 1) / kTile;
  const int rows = (picture.height + kTile - 1) / kTile;
  workers_.run(static_cast<std::size_t>(columns * rows), [&](std::size_t i) {
    const int tile = static_cast<int>(i);
    task(tile % columns * kTile, tile / columns * kTile);
  });
}

void Renderer::render(const Lens& lens, const Shot& shot, Picture& picture) {
  begin(lens, shot, picture, 1);
  picture.radiance.resize(picture.instance.size());
  details_.resize(picture.instance.size());
  forTiles(picture, [&](int left, int top) { drawTile(left, top, picture); });
  forTiles(picture, [&](int left, int top) { smoothTile(left, top, picture); });
  if (shot.exposure_s <= 0.0) return;
  blurred_.resize(picture.radiance.size());
  workers_.run(static_cast<std::size_t>(picture.height),
               [&](std::size_t row) { blurRow(static_cast<int>(row), picture); });
  picture.radiance.swap(blurred_);
}

void Renderer::drawTile(int left, int top, Picture& picture) {
  constexpr int kColumns = 4, kRows = 2;
  for (int y = top; y < std::min(top + kTile, picture.height); y += kRows) {
    for (int x = left; x < std::min(left + kTile, picture.width); x += kColumns) {
      Packet packet;
      std::array<Place, kPacket> places;
      for (int i = 0; i < kColumns * kRows; ++i) {
        const Place place{x + i % kColumns, y + i / kColumns};
        if (place.column >= picture.width || place.row >= picture.height) continue;
        if (!lens_->sees(place.column, place.row)) {
          const std::size_t at = picture.index(place.column, place.row);
          picture.radiance[at].setZero();
          picture.instance[at] = kNothing;
          details_[at] = {};
          continue;
        }
        places[packet.count] = place;
        aim(packet, place.column, place.row, 0.0F, 0.0F);
      }
      drawBlock(packet, places.data(), picture);
    }
  }
}

void Renderer::drawBlock(Packet& packet, const Place* places, Picture& picture) {
  if (packet.count == 0) return;
  follow(packet);
  findSun(packet);
  for (unsigned i = 0; i < packet.count; ++i) {
    const std::size_t at = picture.index(places[i].column, places[i].row);
    const Hit& hit = packet.hits[i];
    picture.instance[at] = hit.instance;
    picture.radiance[at] << lighting_.shade(packet.origins[i], packet.directions[i], hit,
                                            packet.in_sun[i], lens_->pixelAngle()),
        0.0F;
    Detail& detail = details_[at];
    if (hit.instance == kNothing) {
      detail = {};
      continue;
    }
    detail.key = ((hit.instance * 2654435761U) ^ (hit.material * 40503U << 1)) * 2U +
                 (packet.in_sun[i] ? 1U : 0U) + 2U;
    detail.inverse_distance = 1.0F / hit.distance;
    detail.normal = hit.normal;
  }
}

void Renderer::identify(const Lens& lens, const Shot& shot, int step, Picture& picture) {
  begin(lens, shot, picture, step);
  workers_.run(static_cast<std::size_t>(picture.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < picture.width; x += static_cast<int>(kPacket)) {
      Packet packet;
      std::array<std::size_t, kPacket> places;
      for (int i = x; i < std::min(x + static_cast<int>(kPacket), picture.width); ++i) {
        picture.instance[picture.index(i, y)] = kNothing;
        if (!lens_->sees(i * step, y * step)) continue;
        places[packet.count] = picture.index(i, y);
        aim(packet, i * step, y * step, 0.0F, 0.0F);
      }
      if (packet.count == 0) continue;
      follow(packet);
      for (unsigned i = 0; i < packet.count; ++i) {
        picture.instance[places[i]] = packet.hits[i].instance;
      }
    }
  });
}

}  // namespace perdure::tools
