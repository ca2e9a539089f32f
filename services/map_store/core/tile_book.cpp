#include "services/map_store/core/tile_book.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace perdure::map_store {

TileChanges TileBook::replace(const Square& square, std::vector<MapObject> objects,
                              InstanceId instance, std::uint64_t revision) {
  const auto known = squares_.find(square);
  const Size before = known == squares_.end() ? Size{} : known->second;
  const auto capacity = static_cast<std::ptrdiff_t>(kMapTileCapacity);
  const Size after{
      static_cast<std::int32_t>((objects.size() + kMapTileCapacity - 1) / kMapTileCapacity),
      static_cast<std::uint32_t>(objects.size())};
  TileChanges changes;
  for (std::int32_t part = 0; part < std::max(before.tiles, after.tiles); ++part) {
    MapTile tile{instance, square.x, square.y, part, revision, {}};
    if (part >= after.tiles) {
      changes.emptied.push_back(std::move(tile));
      continue;
    }
    const auto first = objects.begin() + part * capacity;
    const auto last = first + std::min(capacity, objects.end() - first);
    std::move(first, last, std::back_inserter(tile.objects));
    changes.tiles.push_back(std::move(tile));
  }
  tiles_ += static_cast<std::uint32_t>(after.tiles) - static_cast<std::uint32_t>(before.tiles);
  objects_ += after.objects - before.objects;
  if (after.tiles == 0) {
    squares_.erase(square);
  } else {
    squares_[square] = after;
  }
  return changes;
}

}  // namespace perdure::map_store
