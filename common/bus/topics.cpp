#include "common/bus/topics.h"

#include <algorithm>
#include <array>

namespace perdure::bus {
namespace {

constexpr double kCameraHz = 10.0;
constexpr double kImuHz = 100.0;
constexpr std::string_view kFramePrefix = "frame/";
constexpr Roles kWatchers = Role::kRecord | Role::kOperator | Role::kGateway | Role::kRos2 |
                            Role::kRos2Driver;  // roles that read all topics

template <class T>
TopicInfo row(const Topic<T>& topic, Qos qos, double rate_hz, bool recorded, Roles writers,
              Roles readers) {
  // The names in the table stay valid, because they are constants of topics.h.
  return {topic.name,
          &wire::Type<T>::descriptor(),
          qos,
          rate_hz,
          recorded,
          writers | Role::kPlayer,
          readers | kWatchers};
}

constexpr Qos reliable(int depth) { return {.depth = depth}; }
constexpr Qos kept(int depth) { return {.depth = depth, .kept = true}; }
constexpr Qos keptAndShared(int depth) {
  return {.depth = depth, .kept = true, .shared_memory = true};
}
constexpr Qos bestEffort(int depth) { return {.reliable = false, .depth = depth}; }
constexpr Qos latched(int depth, double lease_s = 0.0) {
  return {.depth = depth, .latched = true, .lease_s = lease_s};
}
Qos exclusive(int depth, double rate_hz) {
  return {.depth = depth, .exclusive = true, .lease_s = leaseFor(rate_hz)};
}

using Table = std::array<TopicInfo, 20>;

/// The roles after the rate are the writers and the readers, without the roles that record and
/// monitor.
Table makeTable() {
  using namespace topics;
  using enum Role;
  constexpr bool kRecorded = true, kNotRecorded = false;
  constexpr Roles kServices = kCapture | kVio | kInference | kSemanticFilter | kMapStore;
  return {
      TopicInfo{kFramePrefix, &wire::Type<Frame>::descriptor(), keptAndShared(4), kCameraHz,
                kRecorded, kCapture | kPlayer | kRos2Driver, kVio | kInference | kWatchers},
      row(kImu, latched(512), kImuHz, kRecorded, kCapture | kRos2Driver, kVio),
      row(kSpeed, latched(512), kImuHz, kRecorded, kCapture, kVio),
      row(kCalibration, latched(1), 0, kRecorded, kCapture | kRos2Driver,
          kVio | kSemanticFilter | kMapStore | kSubscriber),  // map_store: position on Earth
      row(kOdometry, reliable(64), kCameraHz, kRecorded, kVio | kRos2Driver,
          // capture reads it with pace.mode; vio reads it only if another program writes it
          kSemanticFilter | kCapture | kMapStore | kVio | kSubscriber),
      row(kLandmarks, reliable(64), kCameraHz, kRecorded, kVio,
          kSemanticFilter | kMapStore | kSubscriber),
      row(kDetections, exclusive(32, kCameraHz), kCameraHz, kRecorded, kInference | kRos2Driver,
          kInference | kSemanticFilter | kCapture | kSubscriber),
      row(kModel, latched(1), 0, kRecorded, kInference | kRos2Driver,
          kInference | kSemanticFilter | kSubscriber),
      row(kSwap, reliable(16), 0, kRecorded, kInference, kInference | kSemanticFilter),
      row(kObjects, kept(8), kCameraHz, kRecorded, kSemanticFilter,
          kMapStore | kVio | kSubscriber),  // vio masks moving objects (input.moving_mask)
      row(kObjectState, latched(1), 0, kNotRecorded, kSemanticFilter, kSubscriber),
      row(kEvents, latched(256), 0, kRecorded, kSemanticFilter | kMapStore,
          kSubscriber),  // map_store writes loops of the graph
      row(kPredictions, bestEffort(1), kCameraHz, kRecorded, kSemanticFilter,
          kInference | kSubscriber),
      row(kMap, latched(1), 0, kNotRecorded, kMapStore, kSubscriber),
      row(kMapHeader, latched(1), 0, kNotRecorded, kMapStore, kSubscriber),
      row(kMapFrame, latched(1), 0, kRecorded, kMapStore, kSubscriber),
      row(kMapNear, latched(1), 0, kRecorded, kMapStore, kSemanticFilter),
      row(kMapQuery, reliable(16), 0, kRecorded,
          kSemanticFilter | kOperator | kSubscriber | kGateway, kMapStore),
      row(kMapReply, reliable(16), 0, kRecorded, kMapStore, kSubscriber),
      row(kHealth, latched(1, 1.0), 1.0, kRecorded,
          kServices | kRecord | kGateway | kRos2 | kRos2Driver, kSubscriber),
  };
}

}  // namespace

std::string TopicInfo::typeName() const { return type->m_typename; }

std::span<const TopicInfo> topicTable() {
  static const Table table = makeTable();
  return table;
}

const TopicInfo* findTopic(std::string_view name) {
  for (const TopicInfo& info : topicTable()) {
    const bool camera = info.name == kFramePrefix && name.starts_with(kFramePrefix) &&
                        name.size() > kFramePrefix.size();
    if (camera || (info.name == name && name != kFramePrefix)) return &info;
  }
  return nullptr;
}

double expectedRate(const TopicInfo& info, double camera_hz, double imu_hz) {
  if (info.rate_hz == kCameraHz) return camera_hz;
  return info.rate_hz == kImuHz ? imu_hz : info.rate_hz;
}

double leaseFor(double rate_hz) {
  constexpr double kShortest = 0.1;  // shorter leases expire falsely on a busy machine (measured)
  return rate_hz > 0 ? std::max(kShortest, 3.0 / rate_hz) : kShortest;
}

}  // namespace perdure::bus
