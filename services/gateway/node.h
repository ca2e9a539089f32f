// The gateway without bus and sockets. It converts messages of the bus to messages of channels,
// only for channels with viewers, and once for all viewers.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/base/sink.h"
#include "common/camera/camera_model.h"
#include "common/earth/earth_place.h"
#include "common/types/map.h"
#include "common/types/odometry.h"
#include "services/gateway/config.h"
#include "services/gateway/core/beliefs.h"
#include "services/gateway/core/channels.h"
#include "services/gateway/core/map_graph.h"
#include "services/gateway/core/map_layer.h"
#include "services/gateway/core/scene.h"
#include "services/gateway/core/seen_ground.h"
#include "services/gateway/core/vital_signs.h"
#include "services/gateway/core/world.h"

namespace perdure::gateway {

struct Outputs {
  Sink<Encoded> message;
  Sink<TimePoint> time;  ///< time of the newest message
  Sink<Answer> answer;
  Sink<MapQuery> query;
  Sink<MapCorrection> correction = [](const MapCorrection&) {};
};

/// Converts messages. Times `now_ns` are on CLOCK_MONOTONIC.
class Node {
 public:
  Node(const Config& config, const std::string& vehicle, InstanceId instance, Outputs outputs);

  /// Sets the channels that clients view. New channels receive the current state.
  void setWanted(const Channels& wanted);

  void onCalibration(const Calibration& calibration);
  void onFrame(std::size_t camera, const Frame& frame);
  void onOdometry(const Odometry& odometry, std::int64_t now_ns);
  void onLandmarks(const Landmarks& landmarks);
  void onDetections(const Detections& detections);
  void onModel(const ModelInfo& model);
  void onObjects(const Objects& objects, std::int64_t now_ns);
  /// Take the newest message that its writer sent before the first viewer came, for example at the
  /// end of a drive.
  void onObjectsOfBefore(const Objects& objects);
  void onFrameOfBefore(std::size_t camera, const Frame& frame);
  void onEvent(const Event& event);
  void onHealth(const Health& health, std::int64_t now_ns) {
    vital_signs_.onHealth(health, now_ns);
  }
  void onMapFrame(const MapFrame& frame);
  void onMapTile(const MapTile& tile) { map_.put(tile); }
  void onMapTileGone(const MapTile& key) { map_.erase(key); }
  void onMapReply(const MapReply& reply);
  /// Takes a graph that map_store sent to another program. Recordings contain such replies.
  void onMapGraph(const MapReply& reply);
  void onCall(const Call& call, std::int64_t now_ns);
  /// Does the periodic work. Call it about ten times a second while clients are connected or
  /// waits() is true.
  void tick(std::int64_t now_ns);
  bool waits() const { return !pending_.empty(); }

  void setStandIns(std::map<std::string, std::string> sentences) {
    vital_signs_.setStandIns(std::move(sentences));
  }
  const VitalSigns& vitalSigns() const { return vital_signs_; }
  std::size_t objects() const { return objects_ ? objects_->objects.size() : 0; }
  std::optional<TimePoint> shownTime() const {
    return objects_ ? std::optional(objects_->stamp.time) : std::nullopt;
  }
  const ReasonCounts& reasons() const { return reasons_; }

 private:
  struct Pending {
    Call call;
    std::function<void()> send;
    std::int64_t until_ns = 0, next_ns = 0;
  };
  /// Limits a rate by times of the sensor clock.
  struct Pace {
    double rate_hz = 0;
    std::optional<TimePoint> last = {};
    bool due(TimePoint time);
  };

  bool wants(std::uint32_t channel) const { return wanted_.contains(channel); }
  /// Sends a message. Without `time`, the time of the newest message is used.
  void send(std::uint32_t channel, std::string payload, std::optional<TimePoint> time = {});
  void sendScene();
  void sendWanted(std::initializer_list<std::uint32_t> channels);
  void sendNow(std::uint32_t channel);
  void sendNow(std::size_t camera, std::uint32_t channel);
  void take(const Objects& objects);
  void beginAnew(TimePoint time);
  void sendObjects();
  void sendPose(TimePoint time);
  void sendAnnotations(std::size_t camera, bool now);
  void sendAwaited();
  struct Happened {
    Event event;
    std::optional<Eigen::Vector3d> place;  ///< position in W
  };
  void sendEvent(const Happened& happened, bool as_log);
  std::optional<Eigen::Vector3d> placeOf(const Event& event) const;
  void placeEvents();
  bool wantsTiles() const { return wants(kMap) || wants(kMapScene); }
  std::size_t sendMap();  ///< number of objects sent
  bool wantsGraph() const { return wants(kMapGraph) || wants(kMapGraphScene) || wants(kMapSeen); }
  double groundHeight() const;
  double bodySigma() const;
  void lookAtGround();
  // Defined in node_calls.cpp.
  void lookAtGraph(bool looked_before);
  void followGraph(std::int64_t now_ns);
  void onNoGraph(const std::string& why);
  void sendGraph(std::uint32_t channel);
  void noteReturns(const Event& event);
  void newest(TimePoint time);
  /// The newest pose of the body: that of odometry if received, otherwise that of objects.
  struct Body {
    TimePoint time;
    WorldId world;
    RigidTransform T_WB;
  };
  std::optional<Body> body() const;
  RigidTransform pose() const { return body().value_or(Body{}).T_WB; }
  WorldId world() const { return body().value_or(Body{}).world; }  ///< the current W
  /// Sends a question to map_store, again and again until the reply.
  template <class Question>
  void ask(const Call& call, Question question, const Sink<Question>& to, std::int64_t now_ns);
  void ask(const Call& call, const MapQuery& query, std::int64_t now_ns) {
    ask(call, query, outputs_.query, now_ns);
  }
  void askForObject(const Call& call, std::int64_t now_ns);
  void askForMap(const Call& call, std::int64_t now_ns);
  void askForCorrection(const Call& call, std::int64_t now_ns);
  void fail(const Call& call, const std::string& sentence);
  void answer(const Call& call, std::string payload, bool ok = true);

  const Config config_;
  const InstanceId instance_;
  const Outputs outputs_;
  Channels wanted_;
  VitalSigns vital_signs_;
  Silence last_;
  TimePoint time_;
  bool away_ = false;  ///< there were no viewers; the stored state may be outdated

  std::optional<Calibration> calibration_;
  std::vector<std::optional<CameraModel>> cameras_;
  std::optional<Odometry> odometry_;
  std::optional<Objects> objects_;
  std::optional<ModelInfo> model_;
  std::map<std::string, std::deque<Detections>> detections_;
  std::set<std::size_t> awaited_;  ///< cameras whose annotations wait for the detections of
                                   ///< objects_' frame
  bool unplaced_ = false;          ///< an event of the whole map was received before the first pose
  std::deque<Happened> events_;
  std::map<ObjectId, Event> returns_;
  MapLayer map_;
  bool map_due_ = false;
  GraphPace graph_pace_;
  std::optional<MapReply> graph_;
  std::string why_no_graph_ = "It is asked for.";
  double latency_ms_ = -1.0;
  Scene scene_;
  Trajectory trajectory_;
  EarthPlace earth_;
  SeenGround seen_ground_;
  History history_;
  std::vector<Pace> image_pace_;
  Pace scene_pace_, pose_pace_, trajectory_pace_{2.0}, seen_pace_{0.5};
  std::int64_t next_health_ns_ = 0, next_map_ns_ = 0, ticked_ns_ = 0;
  std::map<std::uint64_t, Pending> pending_;
  std::uint64_t next_request_ = 1;
  ReasonCounts reasons_;
};

}  // namespace perdure::gateway
