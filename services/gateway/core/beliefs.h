// Perdure's own JSON messages: objects, events, detections, and replies about the map.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/types/map.h"
#include "common/types/objects.h"
#include "services/gateway/core/map_layer.h"

namespace perdure::gateway {

/// Returns the message "perdure.Objects". A negative `latency_ms`, and `body_sigma` (m, of the body
/// in W), is unknown.
std::string objectsAtAGlance(const Objects& objects, double latency_ms, double body_sigma = -1);
/// Return an event as "perdure.Event", and its text as "foxglove.Log". `place`: position of the
/// event in W.
std::string eventJson(const Event& event, const std::optional<Eigen::Vector3d>& place = {});
std::string eventLog(const Event& event);
/// Returns "perdure.Detections". If `model` is nullptr, the classes have no names.
std::string detectionsJson(const Detections& detections, const ModelInfo* model);
std::string modelJson(const ModelInfo& model);

/// Returns the map store's answer as "perdure.MapReply". `map`: the displayed M. Objects of other
/// maps are marked "elsewhere".
std::string mapReplyJson(const MapReply& reply, const WorldId& map);

/// Stores the existence, class probability and visibility of the objects, twice a second for the
/// last five minutes.
class History {
 public:
  void add(const Objects& objects);
  struct Sample {
    double time_s = 0, existence = 0, probability = 0, fraction = 0;
  };
  const std::deque<Sample>* of(ObjectId id) const;
  void clear() { samples_.clear(); }

 private:
  std::map<ObjectId, std::deque<Sample>> samples_;
};

/// Returns "perdure.Object": state, ledger, predicted reappearance (`returns`) and history of an
/// object.
std::string objectInFull(const ObjectBelief& object, const std::optional<Event>& returns,
                         const std::deque<History::Sample>* history);

/// Returns "perdure.Map", in M. `view`: all known objects; `shown`: the objects to send.
std::string mapJson(const MapLayer::View& view, const std::vector<MapObject>& shown,
                    TimePoint time);

}  // namespace perdure::gateway
