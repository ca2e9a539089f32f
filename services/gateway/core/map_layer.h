// The durable map in M and the working set in W, connected by T_MW of `map/frame`.
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
  void follow(const MapFrame& frame);
  void put(const MapTile& tile);
  void erase(const MapTile& key);
  /// Clears the tiles. Call it when they are not received any more.
  void clear() { tiles_.clear(); }
  bool empty() const { return tiles_.empty(); }
  bool takeChanged();

  /// Returns the newest `map/frame` if it belongs to this W; otherwise nullptr.
  const MapFrame* frameOf(const WorldId& world) const;
  /// Returns the transform of points from W to M. It is the identity if no `map/frame` of this W
  /// was received, because map_store then publishes objects of W unchanged.
  RigidTransform T_MW(const WorldId& world) const;
  WorldId mapOf(const WorldId& world) const;

  struct View {
    std::vector<MapObject> here;  ///< objects in the M of this W
    std::size_t elsewhere = 0;    ///< number of objects of other maps, whose transform to
                                  ///< this M is unknown
  };
  View viewFrom(const WorldId& world) const;

 private:
  std::map<std::tuple<std::int32_t, std::int32_t, std::int32_t>, MapTile> tiles_;
  std::optional<MapFrame> frame_;
  bool changed_ = false;
};

/// Returns the message "perdure.MapFrame".
std::string mapFrameJson(const MapFrame& frame);

inline constexpr std::size_t kMostOfMap = 2000;
/// Returns the kMostOfMap objects nearest to the body, nearest first. `p_MB`: position of the body
/// in M.
std::vector<MapObject> nearestTo(const Eigen::Vector3d& p_MB, std::vector<MapObject> objects);

}  // namespace perdure::gateway
