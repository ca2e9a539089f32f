// Long-term memory (the paper's "semantic map"): stores confirmed objects of semantic_filter,
// publishes them as tiles and answers queries. A filter that restarts receives its working set
// again.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "common/base/ids.h"
#include "common/base/result.h"
#include "common/base/sink.h"
#include "common/earth/earth_place.h"
#include "common/mapping/mapper.h"
#include "common/types/map.h"
#include "common/types/objects.h"
#include "services/map_store/config.h"
#include "services/map_store/core/map_database.h"
#include "services/map_store/core/map_places.h"
#include "services/map_store/core/reply_cache.h"
#include "services/map_store/core/tile_book.h"

namespace perdure::map_store {

/// Number of ids that are skipped after a start of map_store, because the last ids in use may not
/// be stored.
inline constexpr ObjectId kIdReserve = 4096;

/// Returns the reason why the query cannot be answered; empty if it can be answered.
std::string faultOf(const MapQuery& query);

struct Outputs {
  Sink<MapTile> tile;
  Sink<MapTile> emptied;  ///< only the key is valid; the tile must be disposed of
  Sink<MapHeader> header;
  Sink<MapReply> reply;
  Sink<MapNear> near;
  Sink<MapFrame> frame = [](const MapFrame&) {};
  Sink<Event> event = [](const Event&) {};  ///< events of the graph
};

class Node {
 public:
  /// Opens the map. Throws StartupError with the fix if it cannot be opened.
  Node(const Config& config, InstanceId instance, Outputs outputs);
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  void onObjects(const Objects& objects);
  void onOdometry(const Odometry& odometry);
  /// The map stores what the cameras see, and the position on Earth that follows from the
  /// calibration's anchor.
  void onCalibration(const Calibration& calibration) {
    earth_.onCalibration(calibration);
    cameras_ = calibration;
  }
  void onLandmarks(const Landmarks& landmarks);
  void onQuery(const MapQuery& query);
  /// Takes a correction by a person, or withdraws one. The reply is sent after the commit.
  void onCorrection(const MapCorrection& request);
  /// Commits and publishes changes that are due. `now` is a monotonic time with any origin. Call it
  /// at least ten times a second.
  void tick(Duration now);
  /// Call it when a server has the outbox's entries up to `number`. The next commit removes them.
  void onAcknowledged(std::int64_t number) { acknowledged_ = std::max(acknowledged_, number); }
  /// Commits and publishes the remaining changes. Call it before the process ends.
  void flush();

  const ReasonCounts& reasons() const { return reasons_; }
  const mapping::Mapper& mapper() const { return mapper_; }
  /// A sentence for the user with the fix; empty if there is no trouble.
  std::string trouble() const { return failure_.empty() ? notice_ : failure_; }
  std::uint64_t received() const { return received_; }
  std::uint64_t commits() const { return commits_; }

 private:
  // These are in node_graph.cpp.
  void loadGraph();
  void loadFacts();
  void followGraph();
  void reportLoops(const mapping::MapChange& change);
  void reportFrame();
  void reportWithdrawals(const mapping::MapChange& change);
  struct NewEarth {
    std::string text;  ///< empty: not changed
    std::pair<std::uint64_t, TimePoint> of{};
  };
  NewEarth newEarthAnchor();

  bool wasConfirmed(TrackId track) const;
  void takeEnded(const std::vector<EndedTrack>& ended);
  void leaveBehind(const Objects& next);
  bool acceptable(const ObjectBelief& belief);
  std::string camerasText() const;
  void commit();
  MapReply answer(const MapQuery& query);
  MapReply emptyReply(InstanceId client, std::uint64_t request) const;
  void answerGraph(const MapQuery& query);  ///< in node_graph.cpp
  // These are in node_corrections.cpp.
  bool isKnown(ObjectId id);
  std::string faultOfPair(const Correction& correction) const;
  std::string faultOfNew(const Correction& correction);
  std::string completed(Correction& correction);
  void publishCorrections();
  void addCorrections(MapNear& near) const;
  // These are in node_view.cpp.
  bool loadView();
  void followView(const std::vector<ObjectId>& changed);
  void publish();
  bool publishSquare(const Square& square, const std::vector<ObjectId>& ids);
  Result<Found> find(const MapQuery& query);

  // These are in node_near.cpp.
  void sendNear();
  void restore(const MapQuery& query);
  const Objects* workingSetFor(const MapQuery& query) const;
  MapNear nearNow();
  MapNear blankNear(InstanceId client, const WorldId& world) const;
  void putNearByGraph(MapNear& near);
  void putNearAsStored(MapNear& near);
  void give(const mapping::Recallable& there, MapNear& near);
  void publish(MapNear near);
  void blame(const Reason& reason);

  const Config config_;
  const InstanceId instance_;
  const Outputs outputs_;
  MapDatabase database_;
  mapping::Mapper mapper_;
  EarthPlace earth_;
  std::optional<Calibration> cameras_;  ///< a calibration that is not stored yet
  bool earth_stored_ = false;  ///< an earlier process stored the position; it is not overwritten
  std::optional<std::pair<std::uint64_t, TimePoint>>
      told_earth_;                ///< revision of the graph and earth_.known() at the last write
  std::set<ObjectId> corrected_;  ///< objects with corrections since the last commit
  bool graph_ = false;            ///< whether the graph is enabled and its stored state was read
  ReplyCache replies_;
  TileBook tiles_;
  MapInM view_;                      ///< objects in M as of the last commit
  std::uint64_t view_revision_ = 0;  ///< revision of the graph
  std::size_t view_anchors_ = 0;
  std::map<Square, std::vector<ObjectId>> stale_squares_;  ///< squares to publish
  std::optional<Objects> newest_;    ///< newest working set, received or loaded, with track ids
  std::optional<Objects> previous_;  ///< last working set of the previous filter
  TimePoint client_since_;           ///< time of this filter's first message in this W
  std::map<TrackId, PlacedBelief> left_;
  std::map<TrackId, Removal> removed_;
  struct Given {
    std::uint64_t graph = 0;  ///< revision of the graph that placed it
    std::uint64_t near = 0;   ///< revision of the map/near message that contained it
  };
  std::map<TrackId, Given> placed_;  ///< tracks sent in `placed` and not detected since
  struct Join {
    TrackId seen = 0;
    std::uint64_t near = 0;  ///< revision of the first map/near message with the known track; 0:
                             ///< not sent yet
  };
  /// Key: a known track. Value: a new track of the same object, which the filter must fuse with it.
  std::map<TrackId, Join> joins_;
  std::uint64_t near_revision_ = 0;
  std::optional<MapNear> near_;                 ///< last message sent
  std::optional<Eigen::Vector3d> near_from_W_;  ///< position of the body at the last sendNear()
  struct ReportedFrame {
    WorldId world;
    std::uint64_t revision = 0;
    std::size_t anchors = 0;
    bool operator==(const ReportedFrame&) const = default;
  };
  std::optional<ReportedFrame> reported_frame_;
  std::deque<mapping::LoopWithdrawal> withdrawn_;  ///< the newest ones, for queries about the graph
  ObjectId next_id_ = 1;
  InstanceId kept_of_ = 0;  ///< instance of the filter whose working set is on the disk
  TimePoint kept_;          ///< time of its newest frame on the disk
  std::uint64_t revision_ = 0;
  std::int64_t acknowledged_ = 0;  ///< entries of the outbox up to this one are to be removed
  bool dirty_ = false, published_once_ = false, header_stale_ = false;
  std::optional<Duration> committed_at_, published_at_;
  ReasonCounts reasons_;
  std::string notice_, failure_;
  std::uint64_t received_ = 0, commits_ = 0;
};

}  // namespace perdure::map_store
