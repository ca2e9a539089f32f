// What the gateway offers: one table of channels and services, from which `advertise`, the
// schemas, the queues and the README come.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/base/time.h"

namespace perdure::gateway {

/// Of each camera besides: kCamera + kPerCamera · index + one of CameraPart.
enum Channel : std::uint32_t {
  kTransforms = 1,
  kScene,
  kPose,
  kTrajectory,
  kLandmarks,
  kLog,
  kHealth,
  kObjects,
  kEvents,
  kDetections,
  kMap,
  kModel,
  kCamera = 100,
};
enum CameraPart : std::uint32_t { kImage = 0, kCalibration, kAnnotations, kPerCamera = 10 };

constexpr std::uint32_t cameraChannel(std::size_t camera, CameraPart part) {
  return kCamera + kPerCamera * static_cast<std::uint32_t>(camera) + part;
}

/// What a client that is slow loses, and what one gets that comes late.
enum class Delivery {
  kNewest,   ///< the newest replaces what has not been sent
  kEach,     ///< a queue; the oldest are lost, counted and told
  kLatched,  ///< the newest, also to who comes late
};

struct ChannelInfo {
  std::uint32_t id = 0;
  std::string topic;  ///< "/scene"
  std::string encoding, schema_name, schema_encoding, schema;
  Delivery delivery = Delivery::kNewest;
};

std::vector<ChannelInfo> channelTable(const std::vector<std::string>& cameras);

/// One message of a channel, encoded once for all who look.
struct Encoded {
  std::uint32_t channel = 0;
  TimePoint time;
  std::shared_ptr<const std::string> payload;
};

/// What clients may ask for (the protocol's services), with JSON both ways.
enum Service : std::uint32_t { kObjectService = 1, kMapQueryService };
struct ServiceInfo {
  std::uint32_t id = 0;
  std::string name, type, request_schema, response_schema;
};
std::vector<ServiceInfo> serviceTable();

/// A question of a client to one of them; answered by `client` and `call`.
struct Call {
  std::uint64_t client = 0;
  std::uint32_t service = 0, call = 0;
  std::string payload;
};
struct Answer {
  std::uint64_t client = 0;
  std::uint32_t service = 0, call = 0;
  bool ok = true;
  std::string payload;  ///< JSON; a sentence where !ok
};

using Channels = std::set<std::uint32_t>;

}  // namespace perdure::gateway
