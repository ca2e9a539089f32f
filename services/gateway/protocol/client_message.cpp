#include "services/gateway/protocol/client_message.h"

#include <bit>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

namespace perdure::gateway::protocol {
namespace {

using Json = nlohmann::json;

tl::unexpected<Reason> malformed(const std::string& member, const std::string& is) {
  return fail("member_malformed", "\"" + member + "\" has to be " + is);
}

/// Returns a natural number of at most 32 bits, or nothing for other values.
std::optional<std::uint32_t> naturalOf(const Json& value) {
  if (!value.is_number_integer()) return std::nullopt;
  if (!value.is_number_unsigned() && value.get<std::int64_t>() < 0) return std::nullopt;
  const auto number = value.get<std::uint64_t>();
  if (number > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

std::optional<std::uint32_t> naturalOf(const Json& object, const char* name) {
  if (!object.is_object()) return std::nullopt;
  const auto found = object.find(name);
  return found == object.end() ? std::nullopt : naturalOf(*found);
}

std::string textOf(const Json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

Result<const Json*> listOf(const Json& message, const char* name) {
  const auto found = message.find(name);
  if (found == message.end() || !found->is_array()) return malformed(name, "a list");
  if (found->size() > kMostSubscriptions) {
    return fail("too_many_subscriptions", "one message may name {} at most", kMostSubscriptions);
  }
  return &*found;
}

Result<ClientMessage> subscribe(const Json& message) {
  const auto list = listOf(message, "subscriptions");
  if (!list) return tl::unexpected(list.error());
  Subscribe result;
  for (const Json& one : **list) {
    const auto id = naturalOf(one, "id"), channel = naturalOf(one, "channelId");
    if (!id || !channel) return malformed("subscriptions", "a list of {id, channelId}");
    result.subscriptions.push_back({*id, *channel});
  }
  return result;
}

Result<ClientMessage> unsubscribe(const Json& message) {
  const auto list = listOf(message, "subscriptionIds");
  if (!list) return tl::unexpected(list.error());
  Unsubscribe result;
  for (const Json& one : **list) {
    const auto id = naturalOf(one);
    if (!id) return malformed("subscriptionIds", "a list of numbers");
    result.ids.push_back(*id);
  }
  return result;
}

Result<ClientMessage> fetchAsset(const Json& message) {
  const auto request = naturalOf(message, "requestId");
  if (!request) return malformed("requestId", "a number");
  return FetchAsset{*request, textOf(message, "uri")};
}

/// Reads little-endian numbers and texts from the front of a byte range.
class Take {
 public:
  explicit Take(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  std::optional<std::uint64_t> little(unsigned bytes) {
    if (rest_.size() < bytes) return std::nullopt;
    std::uint64_t value = 0;
    for (unsigned i = 0; i < bytes; ++i) value |= static_cast<std::uint64_t>(rest_[i]) << (8 * i);
    rest_ = rest_.subspan(bytes);
    return value;
  }
  std::optional<std::uint32_t> natural() {
    const auto value = little(4);
    return value ? std::optional(static_cast<std::uint32_t>(*value)) : std::nullopt;
  }
  std::optional<std::string> text(std::size_t length) {
    if (rest_.size() < length) return std::nullopt;
    std::string value(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(length));
    rest_ = rest_.subspan(length);
    return value;
  }
  std::string rest() const { return {rest_.begin(), rest_.end()}; }

 private:
  std::span<const std::uint8_t> rest_;
};

Result<ClientMessage> serviceCall(Take take) {
  const auto service = take.natural(), call = take.natural(), length = take.natural();
  const auto encoding = length ? take.text(*length) : std::nullopt;
  if (!service || !call || !encoding) {
    return fail("binary_short",
                "a service request is u32 service, u32 call, u32 length of the "
                "encoding's name, the name, and the payload");
  }
  return ServiceCall{*service, *call, *encoding, take.rest()};
}

Result<ClientMessage> playbackRequest(Take take) {
  constexpr double kSlowest = 0.01, kFastest = 100.0;
  const auto command = take.little(1), speed = take.little(4), had_seek = take.little(1),
             seek = take.little(8);
  const auto length = take.natural();
  const auto id = length ? take.text(*length) : std::nullopt;
  if (!id) return fail("binary_short", "a playback request ends before its id does");
  const double factor = std::bit_cast<float>(static_cast<std::uint32_t>(*speed));
  constexpr std::uint64_t kLast = std::numeric_limits<std::int64_t>::max();
  if (*command > 1 || !(factor >= kSlowest && factor <= kFastest) || *seek > kLast) {
    return fail("playback_malformed", "play (0) or pause (1), at .01 to 100 times the speed");
  }
  PlaybackRequest request{*command == 0, factor, std::nullopt, id->substr(0, 128)};
  if (*had_seek != 0) request.seek = fromNanoseconds(static_cast<std::int64_t>(*seek));
  return request;
}

}  // namespace

Result<ClientMessage> parseText(std::string_view text) {
  const Json message = Json::parse(text, nullptr, false);
  if (message.is_discarded()) return fail("json_malformed", "a text message has to be JSON");
  if (!message.is_object()) return fail("op_missing", "a message is an object with \"op\"");
  const std::string op = textOf(message, "op");
  if (op.empty()) return fail("op_missing", "a message is an object with \"op\"");
  if (op == "subscribe") return subscribe(message);
  if (op == "unsubscribe") return unsubscribe(message);
  if (op == "getParameters") return GetParameters{textOf(message, "id")};
  if (op == "fetchAsset") return fetchAsset(message);
  for (const char* refused : {"advertise", "unadvertise", "setParameters"}) {
    if (op == refused) return NotOffered{op};
  }
  for (const char* ignored : {"subscribeParameterUpdates", "unsubscribeParameterUpdates",
                              "subscribeConnectionGraph", "unsubscribeConnectionGraph"}) {
    if (op == ignored) return Ignored{};
  }
  return fail("op_unknown", "there is no op \"" + op.substr(0, 64) + "\"");
}

Result<ClientMessage> parseBinary(std::span<const std::uint8_t> bytes) {
  constexpr std::uint8_t kMessage = 1, kServiceRequest = 2, kPlaybackControl = 3;
  if (bytes.empty()) return fail("binary_empty", "a binary message begins with its opcode");
  switch (bytes[0]) {
    case kMessage:
      return NotOffered{"message"};
    case kServiceRequest:
      return serviceCall(Take(bytes.subspan(1)));
    case kPlaybackControl:
      return playbackRequest(Take(bytes.subspan(1)));
    default:
      return fail("binary_unknown", "there is no opcode " + std::to_string(bytes[0]));
  }
}

}  // namespace perdure::gateway::protocol
