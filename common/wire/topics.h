// Every topic of the system, one row each: message, name, quality of service, expected rate,
// whether it is recorded, writers and readers. Names on the wire are perdure/<vehicle>/<name>. Code
// that handles all topics or all messages expands this list.
#pragma once

#include <algorithm>
#include <array>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "common/types/detections.h"
#include "common/types/health.h"
#include "common/types/map.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"
#include "common/wire/roles.h"
#include "final/detections.h"
#include "final/health.h"
#include "final/map.h"
#include "final/objects.h"
#include "final/sensors.h"
#include "idl/detections.h"
#include "idl/health.h"
#include "idl/map.h"
#include "idl/objects.h"
#include "idl/odometry.h"
#include "idl/sensors.h"

namespace perdure::wire {

struct Qos {
  bool reliable = true;
  int depth = 1;               ///< history depth (KEEP_LAST)
  bool latched = false;        ///< TRANSIENT_LOCAL: late joiners receive the last samples
  int late = 0;                ///< number of these last samples; 0: `depth`
  bool kept = false;           ///< writers store the newest sample for ReadFrom::kKept
  bool exclusive = false;      ///< OWNERSHIP EXCLUSIVE and LIVELINESS MANUAL_BY_TOPIC
  double lease_s = 0.0;        ///< lease of the liveliness; 0: infinite
  bool shared_memory = false;  ///< only allowed for topics without key or latching
};

/// Returns the shortest lease, in s, that does not expire falsely: three periods, at least 100 ms.
constexpr double leaseFor(double rate_hz) {
  constexpr double kShortest = 0.1;  // shorter leases expire falsely on a busy machine (measured)
  return rate_hz > 0 ? std::max(kShortest, 3.0 / rate_hz) : kShortest;
}

/// `kDescriptor` is Cyclone's description of the generated struct. `kTwin` is the variant in which
/// every struct is final, with the same memory layout; null if the type itself is final.
template <class T, class WireStruct, const dds_topic_descriptor_t* kDescriptor,
          const dds_topic_descriptor_t* kTwin>
struct TopicRow {
  using Message = T;
  using Wire = WireStruct;
  static const dds_topic_descriptor_t& descriptor() { return *kDescriptor; }
  static const dds_topic_descriptor_t* twin() { return kTwin; }

  std::string_view name;  ///< "frame/" stands for frame/<camera>
  Qos qos;
  double rate_hz;  ///< nominal, for a 10 Hz camera and a 100 Hz IMU; 0: on change
  bool recorded;
  Roles writers, readers;  ///< under DDS-Security, besides the roles for all topics
};

namespace table {

constexpr double kCameraHz = 10.0, kImuHz = 100.0, kOnChange = 0.0;
constexpr bool kRecorded = true, kNotRecorded = false;
constexpr Qos reliable(int depth) { return {.depth = depth}; }
constexpr Qos kept(int depth) { return {.depth = depth, .kept = true}; }
constexpr Qos keptAndShared(int depth) {
  return {.depth = depth, .kept = true, .shared_memory = true};
}
constexpr Qos bestEffort(int depth) { return {.reliable = false, .depth = depth}; }
constexpr Qos latched(int depth, double lease_s = 0.0) {
  return {.depth = depth, .latched = true, .lease_s = lease_s};
}
/// For a sensor whose gaps end the frame of reference. The depth stores 10 s at 400 Hz for a
/// stopped reader, until DDS considers it dead. A new reader receives the samples that vio needs to
/// start.
constexpr Qos kSensor{.depth = 4096, .latched = true, .late = 512};
constexpr Qos exclusive(int depth, double rate_hz) {
  return {.depth = depth, .exclusive = true, .lease_s = leaseFor(rate_hz)};
}

template <class Type, class Twin, const dds_topic_descriptor_t* kTwin>
constexpr const dds_topic_descriptor_t* twinOf() {
  static_assert(sizeof(Type) == sizeof(Twin) && alignof(Type) == alignof(Twin));
  return kTwin;
}

// The two macros build the generated C names from the message's name.
#define PERDURE_FINAL_TOPIC(T, ...) \
  TopicRow<T, perdure_msg_##T, &perdure_msg_##T##_desc, nullptr> { __VA_ARGS__ }
#define PERDURE_TOPIC(T, ...)                                                     \
  TopicRow<T, perdure_msg_##T, &perdure_msg_##T##_desc,                           \
           twinOf<perdure_msg_##T, perdure_fin_##T, &perdure_fin_##T##_desc>()> { \
    __VA_ARGS__                                                                   \
  }

using enum Role;
constexpr Roles kServices = kCapture | kVio | kInference | kSemanticFilter | kMapStore;
constexpr std::tuple kRows{
    PERDURE_FINAL_TOPIC(Frame, "frame/", keptAndShared(4), kCameraHz, kRecorded,
                        kCapture | kRos2Driver, kVio | kInference),
    PERDURE_FINAL_TOPIC(ImuSample, "imu", kSensor, kImuHz, kRecorded, kCapture | kRos2Driver, kVio),
    PERDURE_FINAL_TOPIC(SpeedSample, "speed", kSensor, kImuHz, kRecorded, kCapture, kVio),
    PERDURE_TOPIC(Calibration, "calibration", latched(1), kOnChange, kRecorded,
                  kCapture | kRos2Driver,
                  kVio | kInference | kSemanticFilter | kMapStore |
                      kSubscriber),  // for upright images (inference), and place on Earth
    PERDURE_TOPIC(Calibration, "calibration/estimated", latched(1), kOnChange, kRecorded, kVio,
                  kSemanticFilter | kSubscriber),  // the source is that of the refined calibration
    // capture reads odometry if pace.mode is "follow"; vio reads it if another program writes it.
    PERDURE_FINAL_TOPIC(Odometry, "odometry", reliable(64), kCameraHz, kRecorded,
                        kVio | kRos2Driver,
                        kSemanticFilter | kCapture | kMapStore | kVio | kInference | kSubscriber),
    PERDURE_FINAL_TOPIC(Landmarks, "landmarks", reliable(64), kCameraHz, kRecorded, kVio,
                        kSemanticFilter | kMapStore | kSubscriber),
    PERDURE_TOPIC(Detections, "detections", exclusive(32, kCameraHz), kCameraHz, kRecorded,
                  kInference | kRos2Driver, kInference | kSemanticFilter | kCapture | kSubscriber),
    PERDURE_TOPIC(ModelInfo, "model", latched(1), kOnChange, kRecorded, kInference | kRos2Driver,
                  kInference | kSemanticFilter | kSubscriber),
    PERDURE_TOPIC(SwapNotice, "inference/swap", reliable(16), kOnChange, kRecorded, kInference,
                  kInference | kSemanticFilter),
    PERDURE_TOPIC(Objects, "objects", kept(8), kCameraHz, kRecorded, kSemanticFilter,
                  kMapStore | kVio | kSubscriber),  // vio masks moving objects (input.moving_mask)
    PERDURE_TOPIC(ObjectState, "object_state", latched(1), kOnChange, kNotRecorded, kSemanticFilter,
                  kSubscriber),
    PERDURE_TOPIC(Event, "events", latched(256), kOnChange, kRecorded, kSemanticFilter | kMapStore,
                  kSubscriber),  // map_store, for loops of the graph
    PERDURE_TOPIC(Predictions, "predictions", bestEffort(1), kCameraHz, kRecorded, kSemanticFilter,
                  kInference | kSubscriber),
    PERDURE_TOPIC(MapTile, "map", latched(1), kOnChange, kNotRecorded, kMapStore, kSubscriber),
    PERDURE_TOPIC(MapHeader, "map/header", latched(1), kOnChange, kNotRecorded, kMapStore,
                  kSubscriber),
    PERDURE_TOPIC(MapFrame, "map/frame", latched(1), kOnChange, kRecorded, kMapStore, kSubscriber),
    PERDURE_TOPIC(MapNear, "map/near", latched(1), kOnChange, kRecorded, kMapStore,
                  kSemanticFilter),
    PERDURE_TOPIC(MapQuery, "map/query", reliable(16), kOnChange, kRecorded,
                  kSemanticFilter | kOperator | kSubscriber | kGateway, kMapStore),
    PERDURE_TOPIC(MapCorrection, "map/correct", reliable(16), kOnChange, kRecorded,
                  kOperator | kGateway, kMapStore),
    PERDURE_TOPIC(MapReply, "map/reply", reliable(16), kOnChange, kRecorded, kMapStore,
                  kSubscriber),
    PERDURE_TOPIC(Health, "health", latched(1, 1.0), 1.0, kRecorded,
                  kServices | kRecord | kGateway | kRos2 | kRos2Driver, kSubscriber),
};

#undef PERDURE_TOPIC
#undef PERDURE_FINAL_TOPIC

}  // namespace table

using Topics = std::remove_const_t<decltype(table::kRows)>;

template <class Visit>
constexpr void forEachTopic(Visit visit) {
  std::apply([&](const auto&... row) { (visit(row), ...); }, table::kRows);
}

template <class T>
inline constexpr std::size_t kPosition = []<class... Rows>(const std::tuple<Rows...>&) {
  const std::array same{std::is_same_v<T, typename Rows::Message>...};
  return static_cast<std::size_t>(std::find(same.begin(), same.end(), true) - same.begin());
}(table::kRows);

/// The first row of a message type. Type<T>::Wire: the generated struct; Type<T>::descriptor():
/// Cyclone's description.
template <class T>
struct Type : std::tuple_element_t<kPosition<T>, Topics> {};

template <class T>
constexpr std::string_view nameOfTopic() {
  return std::get<kPosition<T>>(table::kRows).name;
}

}  // namespace perdure::wire
