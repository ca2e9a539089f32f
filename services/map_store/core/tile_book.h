// The map in pieces for late joiners: squares cut into tiles of at most kMapTileCapacity objects.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/types/map.h"
#include "services/map_store/core/map_database.h"

namespace perdure::map_store {

struct TileChanges {
  std::vector<MapTile> tiles;    ///< new contents; never empty of objects
  std::vector<MapTile> emptied;  ///< keys only: no such tile any more
};

/// Remembers how many tiles each square has, so that what was emptied can be disposed of.
class TileBook {
 public:
  /// The contents of `square` now, ordered by id. Instance and revision go into each tile.
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
