// What the gateway offers: one table of channels and services, from which `advertise`, the
// schemas, the queues and the README come.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
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
  kMapToOdom,  ///< /map/frame
  kMapScene,
  kMapGraph,
  kMapGraphScene,
  kRaw = 50,  ///< and on: topics of the bus as they are
  kCamera = 100,
};
enum CameraPart : std::uint32_t {
  kImage = 0,
  kCalibration,
  kAnnotations,
  kLikelihood,
  kPerCamera = 10
};

constexpr std::uint32_t cameraChannel(std::size_t camera, CameraPart part) {
  return kCamera + kPerCamera * static_cast<std::uint32_t>(camera) + part;
}

/// What a client that is slow loses, and what one gets that comes late.
enum class Delivery {
  kNewest,  ///< the newest replaces what has not been sent; who comes late gets it
  kEach,    ///< a queue; the oldest are lost, counted and told; who comes late gets the last ones
};

struct ChannelInfo {
  std::uint32_t id = 0;
  std::string topic;  ///< "/scene"
  std::string encoding, schema_name, schema_encoding, schema;
  Delivery delivery = Delivery::kNewest;
};

std::vector<ChannelInfo> channelTable(const std::vector<std::string>& cameras);
/// A topic of the bus as it is, CDR with its IDL: "/raw/imu". For @final types alone, which go as
/// XCDR1: the readers of others do not know XCDR2's delimiters.
ChannelInfo rawChannel(std::uint32_t id, const std::string& topic, const std::string& type,
                       std::string idl);

/// One message of a channel, encoded once for all who look.
struct Encoded {
  std::uint32_t channel = 0;
  TimePoint time;
  std::shared_ptr<const std::string> payload;
};

/// What clients may ask for (the protocol's services), with JSON both ways.
enum Service : std::uint32_t {
  kGraphOfTheMap = 0,  ///< no service: the gateway asks for itself
  kObjectService = 1,
  kMapQueryService,
  kNextEventService
};
struct ServiceInfo {
  std::uint32_t id = 0;
  std::string name, type, request_schema, response_schema;
};
std::vector<ServiceInfo> serviceTable();
/// To go on to the next event; of recordings alone.
ServiceInfo nextEventService();

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

/// What a client wants of a recording that is played (capability playbackControl).
struct PlaybackRequest {
  bool play = true;
  double speed = 1.0;
  std::optional<TimePoint> seek;
  std::string id;  ///< goes back with the answer
};
struct PlaybackState {
  enum class Status : std::uint8_t { kPlaying = 0, kPaused = 1, kBuffering = 2, kEnded = 3 };
  Status status = Status::kPlaying;
  TimePoint time;
  double speed = 1.0;
  bool did_seek = false;
  std::string id;  ///< of the request that this answers; empty: none
};
/// What a recording covers.
struct TimeRange {
  TimePoint first, last;
};

}  // namespace perdure::gateway
