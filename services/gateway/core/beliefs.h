// Perdure's own JSON: a summary of all objects for each frame, and the full state of one object.
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

/// "perdure.Objects". latency_ms below 0: not known.
std::string objectsAtAGlance(const Objects& objects, double latency_ms);
/// "perdure.Event", and its text as "foxglove.Log". `place`: position of the event in W.
std::string eventJson(const Event& event, const std::optional<Eigen::Vector3d>& place = {});
std::string eventLog(const Event& event);
/// "perdure.Detections"; without the model, classes have no names.
std::string detectionsJson(const Detections& detections, const ModelInfo* model);
std::string modelJson(const ModelInfo& model);

/// "perdure.MapReply" from the map store's answer. `map`: M; objects of other maps are "elsewhere".
std::string mapReplyJson(const MapReply& reply, const WorldId& map);

/// History of the objects' existence, class and visibility, twice a second, for some minutes.
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

/// "perdure.Object": its belief, the reasons, the predicted reappearance, and its history.
std::string objectInFull(const ObjectBelief& object, const std::optional<Event>& returns,
                         const std::deque<History::Sample>* history);

/// "perdure.Map", in M. `view`: all known objects; `shown`: the objects that are sent.
std::string mapJson(const MapLayer::View& view, const std::vector<MapObject>& shown,
                    TimePoint time);

}  // namespace perdure::gateway
