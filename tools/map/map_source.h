// Answers queries from a map's file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/mapping/frames/sight.h"
#include "common/types/map.h"
#include "common/types/sensors.h"
#include "services/map_store/core/map_database.h"
#include "services/map_store/core/map_places.h"
#include "tools/map/standing.h"

namespace perdure::tools {

/// The frame of objects from a map's file: M, or W as stored.
enum class MapFrameChoice { kM, kW };

/// One state of a map's file, which a service may write at the same time. All functions throw
/// StartupError.
class MapFile {
 public:
  explicit MapFile(std::string path);
  MapFile(const MapFile&) = delete;
  MapFile& operator=(const MapFile&) = delete;

  /// Answers a query. Spatial queries search query.world; if it is 0, they search the M or W of the
  /// newest session. If it is not 0, objects are in W.
  MapReply ask(MapQuery query, MapFrameChoice frame = MapFrameChoice::kM);
  /// Returns the graph as a running map_store would.
  MapReply graph(const MapQuery& query) const;
  /// Returns the position of M's origin on Earth, and the yaw of M. Returns nothing if the file has
  /// none, or if the newest session is not joined to the map.
  std::optional<GeoAnchor> earthAnchor() const;
  /// Returns the standing of an object, which must exist.
  Standing standing(ObjectId id) const;
  /// Returns the objects that are history, with their last beliefs in M.
  std::vector<map_store::EndedObject> ended();
  /// Returns the fields of view of the last cameras; empty if they are not known.
  std::vector<mapping::Sight> cameras() const;
  /// Returns the time of the last stored frame.
  TimePoint time() const;

 private:
  const mapping::SavedMap& saved() const;
  mapping::MapFrames frames() const;
  const map_store::MapInM& inM();

  std::string path_;
  map_store::Connection connection_;
  mapping::Identity identity_;  ///< only if there are corrections
  CorrectionsOf corrections_;
  map_store::MapReader reader_{&connection_, &corrections_};
  std::optional<Objects> working_;                  ///< the last stored working set
  mutable std::optional<mapping::SavedMap> saved_;  ///< the graph, once it was needed
  std::optional<map_store::MapInM> view_;
};

}  // namespace perdure::tools
