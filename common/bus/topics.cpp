#include "common/bus/topics.h"

#include <algorithm>
#include <array>

namespace perdure::bus {
namespace {

constexpr double kCameraHz = 10.0;
constexpr double kImuHz = 100.0;
constexpr std::string_view kFramePrefix = "frame/";

template <class T>
TopicInfo row(const Topic<T>& topic, Qos qos, double rate_hz, bool recorded) {
  // The table outlives the call: names are those of the constants in topics.h.
  return {topic.name, &wire::Type<T>::descriptor(), qos, rate_hz, recorded};
}

constexpr Qos reliable(int depth) { return {.depth = depth}; }
constexpr Qos shared(int depth) { return {.depth = depth, .shared_memory = true}; }
constexpr Qos bestEffort(int depth) { return {.reliable = false, .depth = depth}; }
constexpr Qos latched(int depth, double lease_s = 0.0) {
  return {.depth = depth, .latched = true, .lease_s = lease_s};
}
Qos exclusive(int depth, double rate_hz) {
  return {.depth = depth, .exclusive = true, .lease_s = leaseFor(rate_hz)};
}

using Table = std::array<TopicInfo, 19>;

Table makeTable() {
  using namespace topics;
  constexpr bool kRecorded = true, kNotRecorded = false;
  return {
      TopicInfo{kFramePrefix, &wire::Type<Frame>::descriptor(), shared(4), kCameraHz, kRecorded},
      row(kImu, latched(512), kImuHz, kRecorded),
      row(kSpeed, latched(512), kImuHz, kRecorded),
      row(kCalibration, latched(1), 0, kRecorded),
      row(kOdometry, reliable(64), kCameraHz, kRecorded),
      row(kLandmarks, reliable(64), kCameraHz, kRecorded),
      row(kDetections, exclusive(32, kCameraHz), kCameraHz, kRecorded),
      row(kModel, latched(1), 0, kRecorded),
      row(kSwap, reliable(16), 0, kRecorded),
      row(kObjects, reliable(8), kCameraHz, kRecorded),
      row(kObjectState, latched(1), 0, kNotRecorded),
      row(kRecalled, reliable(8), 0, kRecorded),
      row(kEvents, latched(256), 0, kRecorded),
      row(kPredictions, bestEffort(1), kCameraHz, kRecorded),
      row(kMap, latched(1), 0, kNotRecorded),
      row(kMapHeader, latched(1), 0, kNotRecorded),
      row(kMapQuery, reliable(16), 0, kRecorded),
      row(kMapReply, reliable(16), 0, kRecorded),
      row(kHealth, latched(1, 1.0), 1.0, kRecorded),
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
  constexpr double kShortest = 0.1;  // under it a busy machine flaps (measured)
  return rate_hz > 0 ? std::max(kShortest, 3.0 / rate_hz) : kShortest;
}

}  // namespace perdure::bus
