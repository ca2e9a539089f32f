// Builds the server's messages of the Foxglove WebSocket protocol, as JSON or as binary messages.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "services/gateway/core/channels.h"

namespace perdure::gateway::protocol {

/// The supported subprotocols, newest first. A client that offers none of them is refused.
inline constexpr std::array<std::string_view, 2> kSubprotocols{"foxglove.sdk.v1",
                                                               "foxglove.websocket.v1"};
/// Selects the subprotocol from a Sec-WebSocket-Protocol header. Returns "" if none is supported.
std::string_view chooseSubprotocol(std::string_view offered);

enum class StatusLevel { kInfo = 0, kWarning = 1, kError = 2 };

/// Returns the message serverInfo. `range`: time range of a recording that clients control; empty
/// for live data.
std::string serverInfo(const std::string& name, const std::string& session,
                       const std::optional<TimeRange>& range = std::nullopt);
std::string advertise(const std::vector<ChannelInfo>& channels);
std::string advertiseServices(const std::vector<ServiceInfo>& services);
std::string status(StatusLevel level, std::string_view message);
std::string noParameters(const std::string& id);
std::string serviceFailure(std::uint32_t service, std::uint32_t call, std::string_view message);

std::string time(TimePoint time);
std::string playbackState(const PlaybackState& state);
std::string serviceResponse(std::uint32_t service, std::uint32_t call, std::string_view json);
std::string assetMissing(std::uint32_t request, std::string_view message);

using MessageHead = std::array<std::uint8_t, 13>;
MessageHead messageHead(std::uint32_t subscription, TimePoint time);

}  // namespace perdure::gateway::protocol
