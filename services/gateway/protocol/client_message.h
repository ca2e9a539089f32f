// Parses messages from clients of the Foxglove WebSocket protocol. Any bytes give a value or a
// reason.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/base/result.h"
#include "services/gateway/core/channels.h"

namespace perdure::gateway::protocol {

inline constexpr std::size_t kMostSubscriptions = 256;

struct Subscription {
  std::uint32_t id = 0, channel = 0;
};
struct Subscribe {
  std::vector<Subscription> subscriptions;
};
struct Unsubscribe {
  std::vector<std::uint32_t> ids;
};
struct GetParameters {
  std::string id;  ///< empty: the message has no id
};
struct FetchAsset {
  std::uint32_t request = 0;
  std::string uri;
};
struct ServiceCall {
  std::uint32_t service = 0, call = 0;
  std::string encoding, payload;
};
/// Valid messages without effect: subscriptions to the connection graph and to parameters.
struct Ignored {};
/// Valid messages that are refused, because this gateway only displays.
struct NotOffered {
  std::string what;
};

using ClientMessage = std::variant<Subscribe, Unsubscribe, GetParameters, FetchAsset, ServiceCall,
                                   PlaybackRequest, Ignored, NotOffered>;

/// Parses a text message. Fails with json_malformed, op_missing, op_unknown, member_malformed or
/// too_many_subscriptions.
Result<ClientMessage> parseText(std::string_view text);
/// Parses a binary message. Fails with binary_empty, binary_unknown, binary_short or
/// playback_malformed.
Result<ClientMessage> parseBinary(std::span<const std::uint8_t> bytes);

}  // namespace perdure::gateway::protocol
