// Long-term memory: keeps what semantic_filter confirmed, publishes it as tiles, answers questions,
// and gives a filter that starts anew its working set back (the paper's "semantic map").
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
#include "common/mapping/mapper.h"
#include "common/types/map.h"
#include "common/types/objects.h"
#include "services/map_store/config.h"
#include "services/map_store/core/map_database.h"
#include "services/map_store/core/map_places.h"
#include "services/map_store/core/reply_cache.h"
#include "services/map_store/core/tile_book.h"
#include "services/map_store/earth_place.h"

namespace perdure::map_store {

/// Ids that a restored filter leaves out, because the last ones given may not have been written.
inline constexpr ObjectId kIdReserve = 4096;

/// Nothing, or why the query cannot be answered.
std::string faultOf(const MapQuery& query);

struct Outputs {
  Sink<MapTile> tile;
  Sink<MapTile> emptied;  ///< a key to dispose of
  Sink<MapHeader> header;
  Sink<MapReply> reply;
  Sink<MapNear> near;
  Sink<MapFrame> frame = [](const MapFrame&) {};
  Sink<Event> event = [](const Event&) {};  ///< of the graph
};

class Node {
 public:
  /// Opens the map. Throws StartupError.
  Node(const Config& config, InstanceId instance, Outputs outputs);
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  void onObjects(const Objects& objects);
  void onOdometry(const Odometry& odometry);
  /// What it says of the vehicle's place on Earth is kept with the map.
  void onCalibration(const Calibration& calibration) { earth_.onCalibration(calibration); }
  void onLandmarks(const Landmarks& landmarks);
  void onQuery(const MapQuery& query);
  /// Commits and publishes what is due. `now`: a monotonic time since any origin; call it ten
  /// times a second or more often.
  void tick(Duration now);
  /// A server has what the outbox holds up to this entry: the next commit takes it away.
  void onAcknowledged(std::int64_t number) { acknowledged_ = std::max(acknowledged_, number); }
  /// Commits what is left. Call it before the end.
  void flush();

  const ReasonCounts& reasons() const { return reasons_; }
  const mapping::Mapper& mapper() const { return mapper_; }
  /// What a person should know: a sentence with the mend, or nothing.
  std::string trouble() const { return failure_.empty() ? notice_ : failure_; }
  std::uint64_t received() const { return received_; }
  std::uint64_t commits() const { return commits_; }

 private:
  // In node_graph.cpp.
  void loadGraph();
  void loadFacts();
  void followGraph();
  void reportLoops(const mapping::MapChange& change);
  void reportFrame();
  void reportWithdrawals(const mapping::MapChange& change);
  struct NewEarth {
    std::string text;  ///< empty: as it is stored
    std::pair<std::uint64_t, TimePoint> of{};
  };
  NewEarth newEarthAnchor();

  void takeEnded(const std::vector<EndedTrack>& ended);
  void leaveBehind(const Objects& next);
  bool acceptable(const ObjectBelief& belief);
  void commit();
  MapReply answer(const MapQuery& query);
  MapReply emptyReply(const MapQuery& query) const;
  void answerGraph(const MapQuery& query);  ///< in node_graph.cpp
  // In node_view.cpp.
  bool loadView();
  void followView(const std::vector<ObjectId>& changed);
  void publish();
  bool publishSquare(const Square& square, const std::vector<ObjectId>& ids);
  Result<Found> find(const MapQuery& query);

  // In node_near.cpp.
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
  bool earth_stored_ = false;  ///< by another process: it stays
  std::optional<std::pair<std::uint64_t, TimePoint>>
      told_earth_;      ///< revision of the graph, known()
  bool graph_ = false;  ///< it is on, and what is stored of it was read
  ReplyCache replies_;
  TileBook tiles_;
  MapInM view_;                      ///< as of the last commit
  std::uint64_t view_revision_ = 0;  ///< of the graph
  std::size_t view_anchors_ = 0;
  std::map<Square, std::vector<ObjectId>> stale_squares_;  ///< to be published
  std::optional<Objects> newest_;    ///< as received, or as loaded, by the ids of tracks
  std::optional<Objects> previous_;  ///< the last one of the filter before this one
  TimePoint client_since_;           ///< of the first one of this filter in this W
  std::map<TrackId, PlacedBelief> left_;
  std::map<TrackId, Removal> removed_;
  struct Given {
    std::uint64_t graph = 0;  ///< revision by which it was placed
    std::uint64_t near = 0;   ///< revision of the message
  };
  std::map<TrackId, Given> placed_;  ///< given to the filter, and not detected since
  struct Join {
    TrackId seen = 0;
    std::uint64_t near = 0;  ///< revision of the first message that gave it; 0: none yet
  };
  /// By a known track: the track that was seen as new, with which the filter is to fuse it.
  std::map<TrackId, Join> joins_;
  std::uint64_t near_revision_ = 0;
  std::optional<MapNear> near_;                ///< as sent last
  std::optional<Eigen::Vector3d> near_from_W_;  ///< where the body was then
  struct ReportedFrame {
    WorldId world;
    std::uint64_t revision = 0;
    std::size_t anchors = 0;
    bool operator==(const ReportedFrame&) const = default;
  };
  std::optional<ReportedFrame> reported_frame_;
  std::deque<mapping::LoopWithdrawal> withdrawn_;  ///< the newest, for who asks for the graph
  ObjectId next_id_ = 1;
  InstanceId kept_of_ = 0;  ///< the filter whose working set is on the disk
  TimePoint kept_;          ///< of its newest frame there
  std::uint64_t revision_ = 0;
  std::int64_t acknowledged_ = 0;  ///< of the outbox, not yet taken away
  bool dirty_ = false, published_once_ = false, header_stale_ = false;
  std::optional<Duration> committed_at_, published_at_;
  ReasonCounts reasons_;
  std::string notice_, failure_;
  std::uint64_t received_ = 0, commits_ = 0;
};

}  // namespace perdure::map_store
