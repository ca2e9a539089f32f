// The channels and services of the gateway.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/time.h"

namespace perdure::gateway {

/// Ids of the channels. In addition, each camera has the channels kCamera + kPerCamera · index +
/// part, for each CameraPart.
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
  kMapSeen,
  kRaw = 50,  ///< first id of the topics that are passed on unchanged
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

/// Selects the messages that slow clients lose, and the messages that late clients receive.
enum class Delivery {
  kNewest,  ///< the newest message replaces an unsent one; late clients receive it
  kEach,    ///< the oldest waiting ones are dropped and counted; late clients receive the last
};

struct ChannelInfo {
  std::uint32_t id = 0;
  std::string topic;  ///< for example "/scene"
  std::string encoding, schema_name, schema_encoding, schema;
  Delivery delivery = Delivery::kNewest;
};

/// Returns the JSON schema `name`, which is one of Foxglove's or Perdure's own.
std::string jsonSchema(std::string_view name);

std::vector<ChannelInfo> channelTable(const std::vector<std::string>& cameras);
/// Returns the channel, for example "/raw/imu", of a topic that is passed on unchanged, as CDR with
/// its IDL. The type must be @final, which uses XCDR1, because clients may not support XCDR2's
/// delimiters.
ChannelInfo rawChannel(std::uint32_t id, const std::string& topic, const std::string& type,
                       std::string idl);

/// One message of a channel, encoded once for all clients. If `payload` has only the changes since
/// the previous message, `whole` is for clients that have not received that message.
struct Encoded {
  std::uint32_t channel = 0;
  TimePoint time;
  std::shared_ptr<const std::string> payload, whole = {};
};

/// Services for clients (in the protocol's sense), with JSON in both directions.
enum Service : std::uint32_t {
  kGraphOfTheMap = 0,  ///< a query of the gateway itself; clients cannot call it
  kObjectService = 1,
  kMapQueryService,
  kNextEventService,
  kCorrectService
};
struct ServiceInfo {
  std::uint32_t id = 0;
  std::string name, type, request_schema, response_schema;
};
std::vector<ServiceInfo> serviceTable();
/// Returns the service that continues playback to the next event. It exists only for recordings.
ServiceInfo nextEventService();

/// A client's call of a service. `client` and `call` identify the answer.
struct Call {
  std::uint64_t client = 0;
  std::uint32_t service = 0, call = 0;
  std::string payload;
};
struct Answer {
  std::uint64_t client = 0;
  std::uint32_t service = 0, call = 0;
  bool ok = true;
  std::string payload;  ///< JSON if `ok`, otherwise a sentence
};

using Channels = std::set<std::uint32_t>;

/// Request of a client to control the playback of a recording (capability playbackControl).
struct PlaybackRequest {
  bool play = true;
  double speed = 1.0;
  std::optional<TimePoint> seek;
  std::string id;  ///< returned with the answer
};
struct PlaybackState {
  enum class Status : std::uint8_t { kPlaying = 0, kPaused = 1, kBuffering = 2, kEnded = 3 };
  Status status = Status::kPlaying;
  TimePoint time;
  double speed = 1.0;
  bool did_seek = false;
  std::string id;  ///< id of the answered request; empty: none
};
struct TimeRange {
  TimePoint first, last;
};

}  // namespace perdure::gateway
