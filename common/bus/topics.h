// Every topic of the system in one table: type, quality of service, expected rate, recorded or not,
// writers and readers. Names on the wire are perdure/<vehicle>/<name>.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/bus/security/roles.h"
#include "common/wire/description/types.h"

namespace perdure::bus {

struct Qos {
  bool reliable = true;
  int depth = 1;               ///< KEEP_LAST
  bool latched = false;        ///< TRANSIENT_LOCAL: late joiners receive the last `depth` samples
  bool kept = false;           ///< writers store the newest sample for ReadFrom::kKept
  bool exclusive = false;      ///< OWNERSHIP EXCLUSIVE and LIVELINESS MANUAL_BY_TOPIC
  double lease_s = 0.0;        ///< lease of the liveliness; 0: infinite
  bool shared_memory = false;  ///< allowed for topics without key and latching only
};

struct TopicInfo {
  std::string_view name;  ///< "frame/" stands for frame/<camera>
  const dds_topic_descriptor_t* type = nullptr;
  Qos qos;
  double rate_hz = 0.0;  ///< nominal, for a 10 Hz camera and a 100 Hz IMU; 0: on change
  bool recorded = true;
  Roles writers = {}, readers = {};  ///< granted by DDS-Security, if enabled

  std::string typeName() const;
};

std::span<const TopicInfo> topicTable();
/// The row of a topic, such as "imu" or "frame/cam0". Returns nullptr if the topic does not exist.
const TopicInfo* findTopic(std::string_view name);

/// The expected rate for a camera and an IMU with these rates; 0: on change.
double expectedRate(const TopicInfo& info, double camera_hz, double imu_hz);

/// The shortest lease that does not expire falsely: three periods, at least 100 ms.
double leaseFor(double rate_hz);

/// A topic's name with the type of its messages.
template <class T>
struct Topic {
  std::string name;
};

namespace topics {
inline Topic<Frame> frame(const std::string& camera) { return {"frame/" + camera}; }
inline const Topic<ImuSample> kImu{"imu"};
inline const Topic<SpeedSample> kSpeed{"speed"};
inline const Topic<Calibration> kCalibration{"calibration"};
inline const Topic<Odometry> kOdometry{"odometry"};
inline const Topic<Landmarks> kLandmarks{"landmarks"};
inline const Topic<Detections> kDetections{"detections"};
inline const Topic<ModelInfo> kModel{"model"};
inline const Topic<SwapNotice> kSwap{"inference/swap"};
inline const Topic<Objects> kObjects{"objects"};
inline const Topic<ObjectState> kObjectState{"object_state"};
inline const Topic<Event> kEvents{"events"};
inline const Topic<Predictions> kPredictions{"predictions"};
inline const Topic<MapTile> kMap{"map"};
inline const Topic<MapHeader> kMapHeader{"map/header"};
inline const Topic<MapFrame> kMapFrame{"map/frame"};
inline const Topic<MapNear> kMapNear{"map/near"};
inline const Topic<MapQuery> kMapQuery{"map/query"};
inline const Topic<MapReply> kMapReply{"map/reply"};
inline const Topic<Health> kHealth{"health"};
}  // namespace topics

/// Calls visit(Topic<T>) with the type that belongs to a name. Returns false if the name is
/// unknown.
template <class Visit>
bool withTopic(const std::string& name, Visit visit) {
  bool found = false;
  const auto offer = [&](const auto& topic) {
    if (found || topic.name != name) return;
    found = true;
    visit(topic);
  };
  using namespace topics;
  constexpr std::string_view kFramePrefix = "frame/";
  if (name.size() > kFramePrefix.size() && name.starts_with(kFramePrefix)) {
    offer(frame(name.substr(kFramePrefix.size())));
  }
  offer(kImu), offer(kSpeed), offer(kCalibration), offer(kOdometry), offer(kLandmarks);
  offer(kDetections), offer(kModel), offer(kSwap), offer(kObjects), offer(kObjectState);
  offer(kEvents), offer(kPredictions), offer(kMap), offer(kMapHeader), offer(kMapFrame);
  offer(kMapNear);
  offer(kMapQuery), offer(kMapReply), offer(kHealth);
  return found;
}

}  // namespace perdure::bus
