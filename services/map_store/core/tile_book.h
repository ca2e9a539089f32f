// The map for late joiners: squares, divided into tiles of at most kMapTileCapacity objects.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/types/map.h"
#include "services/map_store/core/map_database.h"

namespace perdure::map_store {

struct TileChanges {
  std::vector<MapTile> tiles;    ///< new contents; each has at least one object
  std::vector<MapTile> emptied;  ///< tiles that do not exist any more; only their keys are valid
};

/// Stores the number of tiles of each square, so that emptied tiles can be disposed of.
class TileBook {
 public:
  /// Sets the objects of `square`, ordered by id, and returns the changed tiles. Each tile gets the
  /// instance and the revision.
  TileChanges replace(const Square& square, std::vector<MapObject> objects, InstanceId instance,
                      std::uint64_t revision);
  std::uint32_t tiles() const { return tiles_; }
  std::uint32_t objects() const { return objects_; }

 private:
  struct Size {
    std::int32_t tiles = 0;
    std::uint32_t objects = 0;
  };
  std::map<Square, Size> squares_;
  std::uint32_t tiles_ = 0, objects_ = 0;
};

}  // namespace perdure::map_store
