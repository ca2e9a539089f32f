#include "services/gateway/protocol/server_message.h"

#include <algorithm>
#include <bit>

#include "services/gateway/core/json_writer.h"
#include "services/gateway/core/pieces.h"

namespace perdure::gateway::protocol {
namespace {

enum Opcode : std::uint8_t {
  kMessage = 1,
  kTime = 2,
  kServiceResponse = 3,
  kAsset = 4,
  kPlayback = 5
};

template <class Out>
void putLittle(Out& out, std::uint64_t value, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) {
    out.push_back(static_cast<typename Out::value_type>((value >> (8 * i)) & 0xffU));
  }
}

std::uint64_t nanoseconds(TimePoint time) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, toNanoseconds(time)));
}

void putChannel(JsonWriter& json, const ChannelInfo& channel) {
  json.begin('{').with("id", channel.id).with("topic", channel.topic);
  json.with("encoding", channel.encoding).with("schemaName", channel.schema_name);
  json.with("schemaEncoding", channel.schema_encoding).with("schema", channel.schema).end('}');
}

void putSide(JsonWriter& json, const char* side, const std::string& type,
             const std::string& schema) {
  json.key(side).begin('{').with("encoding", "json").with("schemaName", type);
  json.with("schemaEncoding", "jsonschema").with("schema", schema).end('}');
}

}  // namespace

std::string_view chooseSubprotocol(std::string_view offered) {
  for (const std::string_view known : kSubprotocols) {
    for (std::string_view rest = offered; !rest.empty();) {
      const std::size_t comma = std::min(rest.find(','), rest.size());
      std::string_view one = rest.substr(0, comma);
      rest.remove_prefix(std::min(rest.size(), comma + 1));
      while (!one.empty() && (one.front() == ' ' || one.front() == '\t')) one.remove_prefix(1);
      while (!one.empty() && (one.back() == ' ' || one.back() == '\t')) one.remove_suffix(1);
      if (one == known) return known;
    }
  }
  return {};
}

std::string serverInfo(const std::string& name, const std::string& session,
                       const std::optional<TimeRange>& range) {
  JsonWriter json;
  json.begin('{').with("op", "serverInfo").with("name", name).key("capabilities").begin('[');
  json.text("time").text("services");
  if (range)
    json.text("playbackControl").text("rangedPlayback");  // names in newer and in older SDKs
  json.end(']');
  if (range) {
    json.with("dataStartTime", range->first).with("dataEndTime", range->last);
  }
  json.key("supportedEncodings").begin('[').text("json").end(']').key("metadata").begin('{');
  return json.end('}').with("sessionId", session).end('}').take();
}

std::string advertise(const std::vector<ChannelInfo>& channels) {
  JsonWriter json(32768);
  json.begin('{').with("op", "advertise").key("channels").begin('[');
  for (const ChannelInfo& channel : channels) putChannel(json, channel);
  return json.end(']').end('}').take();
}

std::string advertiseServices(const std::vector<ServiceInfo>& services) {
  JsonWriter json(8192);
  json.begin('{').with("op", "advertiseServices").key("services").begin('[');
  for (const ServiceInfo& service : services) {
    json.begin('{').with("id", service.id).with("name", service.name).with("type", service.type);
    putSide(json, "request", service.type + "Request", service.request_schema);
    putSide(json, "response", service.type + "Response", service.response_schema);
    json.end('}');
  }
  return json.end(']').end('}').take();
}

std::string status(StatusLevel level, std::string_view message) {
  JsonWriter json;
  json.begin('{').with("op", "status").with("level", static_cast<int>(level));
  return json.with("message", message).end('}').take();
}

std::string noParameters(const std::string& id) {
  JsonWriter json;
  json.begin('{').with("op", "parameterValues").key("parameters").begin('[').end(']');
  if (!id.empty()) json.with("id", id);
  return json.end('}').take();
}

std::string serviceFailure(std::uint32_t service, std::uint32_t call, std::string_view message) {
  JsonWriter json;
  json.begin('{').with("op", "serviceCallFailure").with("serviceId", service).with("callId", call);
  return json.with("message", message).end('}').take();
}

std::string time(TimePoint time) {
  std::string bytes(1, static_cast<char>(kTime));
  putLittle(bytes, nanoseconds(time), 8);
  return bytes;
}

std::string playbackState(const PlaybackState& state) {
  std::string bytes(1, static_cast<char>(kPlayback));
  bytes += static_cast<char>(state.status);
  putLittle(bytes, nanoseconds(state.time), 8);
  putLittle(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(state.speed)), 4);
  bytes += state.did_seek ? '\x01' : '\0';
  putLittle(bytes, state.id.size(), 4);
  return bytes + state.id;
}

std::string serviceResponse(std::uint32_t service, std::uint32_t call, std::string_view json) {
  constexpr std::string_view kEncoding = "json";
  std::string bytes(1, static_cast<char>(kServiceResponse));
  putLittle(bytes, service, 4);
  putLittle(bytes, call, 4);
  putLittle(bytes, kEncoding.size(), 4);
  bytes += kEncoding;
  bytes += json;
  return bytes;
}

std::string assetMissing(std::uint32_t request, std::string_view message) {
  std::string bytes(1, static_cast<char>(kAsset));
  putLittle(bytes, request, 4);
  bytes += '\x01';
  putLittle(bytes, message.size(), 4);
  bytes += message;
  return bytes;
}

MessageHead messageHead(std::uint32_t subscription, TimePoint time) {
  std::string bytes(1, static_cast<char>(kMessage));
  putLittle(bytes, subscription, 4);
  putLittle(bytes, nanoseconds(time), 8);
  MessageHead head{};
  std::ranges::copy(bytes, head.begin());
  return head;
}

}  // namespace perdure::gateway::protocol
