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
  Sink<Recalled> recalled;
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
  void onEvent(const Event& event);
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
  void followGraph();
  void tellLoops(const mapping::MapChange& change);
  void tellFrame();
  void tellWithdrawals(const mapping::MapChange& change);
  void split(const std::vector<MergeOrder>& splits);
  void renameSplit(Objects& objects);
  void resendOrders();
  struct NewEarth {
    std::string text;  ///< empty: as it is stored
    std::pair<std::uint64_t, TimePoint> of{};
  };
  NewEarth newEarthAnchor();
  /// Sends what the graph has laid near a place, with what else has changed.
  void recallLaid(const Eigen::Vector3d& centre_W, double radius_m,
                  const mapping::MapChange& change, bool lay_again);
  std::optional<ObjectBelief> laidNow(const mapping::Recallable& there);

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

  void restore(const MapQuery& query);
  void recall(const MapQuery& query);
  const Objects* workingSetFor(const MapQuery& query) const;
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
  std::optional<Objects> newest_;                          ///< as received, or as loaded
  std::optional<Objects> previous_;  ///< the last one of the filter before this one
  std::map<ObjectId, PlacedBelief> left_;
  std::map<ObjectId, Removal> removed_;
  std::set<ObjectId> laid_;  ///< by the graph, and not seen since
  std::vector<MergeOrder> unwritten_splits_;
  std::map<ObjectId, ObjectId> splits_;  ///< that the filter has not obeyed: survivors by absorbed
  std::optional<TimePoint> orders_sent_;
  bool adopts_merges_ = true;  ///< the filter may have merged while nobody heard it
  struct ToldFrame {
    WorldId world;
    std::uint64_t revision = 0;
    std::size_t anchors = 0;
    bool operator==(const ToldFrame&) const = default;
  };
  std::optional<ToldFrame> told_frame_;
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
