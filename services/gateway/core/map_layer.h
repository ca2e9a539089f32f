// The durable map as it lies over the working set: its tiles are in M, the working set is in W, and
// T_MW of `map/frame` is between the two.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "common/types/map.h"

namespace perdure::gateway {

class MapLayer {
 public:
  /// `map/frame`.
  void follow(const MapFrame& frame);
  void put(const MapTile& tile);
  void erase(const MapTile& key);
  /// Tiles are no longer heard.
  void clear() { tiles_.clear(); }
  bool empty() const { return tiles_.empty(); }
  /// Whether tiles or T_MW have changed since this was asked last.
  bool takeChanged();

  /// The newest frame, where it is of this W.
  const MapFrame* frameOf(const WorldId& world) const;
  /// Maps points of W into M. Identity where no frame of this W came: the map store then publishes
  /// what lies in W as it is.
  RigidTransform T_MW(const WorldId& world) const;
  /// M, of this W.
  WorldId mapOf(const WorldId& world) const;

  struct View {
    std::vector<MapObject> here;  ///< in the M of this W
    std::size_t elsewhere = 0;    ///< objects of maps whose place in this M is not known
  };
  View viewFrom(const WorldId& world) const;

 private:
  std::map<std::tuple<std::int32_t, std::int32_t, std::int32_t>, MapTile> tiles_;
  std::optional<MapFrame> frame_;
  bool changed_ = false;
};

/// "perdure.MapFrame".
std::string mapFrameJson(const MapFrame& frame);

/// So many objects of the map are told.
inline constexpr std::size_t kMostOfMap = 2000;
/// The nearest kMostOfMap of `objects`, nearest first. `p_MB`: the body in M.
std::vector<MapObject> nearestTo(const Eigen::Vector3d& p_MB, std::vector<MapObject> objects);

}  // namespace perdure::gateway
