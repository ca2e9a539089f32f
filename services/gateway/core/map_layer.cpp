#include "services/gateway/core/map_layer.h"

#include <algorithm>
#include <array>
#include <utility>

#include "common/base/ids.h"
#include "common/types/map_graph.h"
#include "services/gateway/core/pieces.h"

namespace perdure::gateway {

void MapLayer::follow(const MapFrame& frame) {
  frame_ = frame;
  changed_ = true;
}

void MapLayer::put(const MapTile& tile) {
  tiles_[{tile.x, tile.y, tile.part}] = tile;
  changed_ = true;
}

void MapLayer::erase(const MapTile& key) {
  tiles_.erase({key.x, key.y, key.part});
  changed_ = true;
}

bool MapLayer::takeChanged() { return std::exchange(changed_, false); }

const MapFrame* MapLayer::frameOf(const WorldId& world) const {
  return frame_ && frame_->world == world ? &*frame_ : nullptr;
}

RigidTransform MapLayer::T_MW(const WorldId& world) const {
  const MapFrame* frame = frameOf(world);
  return frame != nullptr ? frame->T_MW : RigidTransform();
}

WorldId MapLayer::mapOf(const WorldId& world) const {
  const MapFrame* frame = frameOf(world);
  return frame != nullptr ? frame->map : world;
}

MapLayer::View MapLayer::viewFrom(const WorldId& world) const {
  View view;
  const WorldId map = mapOf(world);
  for (const auto& [key, tile] : tiles_) {
    for (const MapObject& object : tile.objects) {
      if (object.world == map) {
        view.here.push_back(object);
      } else {
        ++view.elsewhere;
      }
    }
  }
  return view;
}

std::string mapFrameJson(const MapFrame& frame) {
  const RigidTransform& T = frame.T_MW;
  const std::array<double, 7> pose{T.p.x(), T.p.y(), T.p.z(), T.q.x(), T.q.y(), T.q.z(), T.q.w()};
  const Eigen::Vector4d sigma = frame.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const std::size_t known = hasCovariance(frame) ? 4 : 0;
  JsonWriter json;
  json.begin('{').with("timestamp", frame.stamp.time).with("world", toHex(frame.world.world));
  json.with("epoch", frame.world.epoch).with("map", toHex(frame.map.world));
  json.with("map_epoch", frame.map.epoch).with("T_MW", pose, 6);
  json.with("body_sigma", {sigma.data(), known}, 4).with("revision", frame.revision);
  json.with("sessions", frame.sessions).with("loops", frame.loops).with("anchors", frame.anchors);
  return json.end('}').take();
}

std::vector<MapObject> nearestTo(const Eigen::Vector3d& p_MB, std::vector<MapObject> objects) {
  const std::size_t shown = std::min(objects.size(), kMostOfMap);
  const auto nearer = [&](const MapObject& a, const MapObject& b) {
    return (a.mean.head<3>() - p_MB).squaredNorm() < (b.mean.head<3>() - p_MB).squaredNorm();
  };
  std::partial_sort(objects.begin(), objects.begin() + static_cast<std::ptrdiff_t>(shown),
                    objects.end(), nearer);
  objects.resize(shown);
  return objects;
}

}  // namespace perdure::gateway
