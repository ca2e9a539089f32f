#include "common/bus/discovery.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <map>

#include "common/bus/dds.h"

namespace perdure::bus {
namespace {

using Guid = std::array<unsigned char, 16>;

Guid guidOf(const dds_guid_t& key) {
  Guid guid{};
  std::memcpy(guid.data(), key.v, guid.size());
  return guid;
}

std::string nameOf(const dds_qos_t* qos) {
  char* name = nullptr;
  if (!dds_qget_entity_name(qos, &name) || name == nullptr) return {};
  std::string result = name;
  dds_free(name);
  return result;
}

/// Visits every live sample of a built-in topic without taking it.
template <class Sample>
void readAll(const Entity& reader, const std::function<void(const Sample&)>& visit) {
  constexpr std::size_t kMost = 1024;
  std::vector<void*> samples(kMost, nullptr);
  std::vector<dds_sample_info_t> infos(kMost);
  const dds_return_t n = dds_read(reader.handle(), samples.data(), infos.data(), kMost, kMost);
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(n, 0)); ++i) {
    const bool alive = infos[i].valid_data && infos[i].instance_state == DDS_IST_ALIVE;
    if (alive) visit(*static_cast<const Sample*>(samples[i]));
  }
  if (n > 0) dds_return_loan(reader.handle(), samples.data(), n);
}

Entity builtinReader(const Participant& participant, dds_entity_t topic) {
  return Entity(dds_create_reader(participant.handle(), topic, nullptr, nullptr));
}

/// Returns the topic that a replacement of the service must write; "frame/" stands for any camera.
/// Returns "" if no other program can replace the service.
std::string_view essentialTopicOf(std::string_view service) {
  if (service == "capture") return "frame/";
  if (service == "vio") return "odometry";
  if (service == "inference") return "detections";
  return {};
}

}  // namespace

bool standsIn(std::string_view service, std::string_view topic, std::string_view process) {
  const std::string_view essential = essentialTopicOf(service);
  // Perdure's services do not replace each other.
  constexpr std::string_view kOurs[] = {"capture", "vio", "inference", "semantic_filter",
                                        "map_store"};
  if (essential.empty() || process.empty()) return false;
  if (std::ranges::find(kOurs, process) != std::end(kOurs)) return false;
  return essential.ends_with('/') ? topic.starts_with(essential) : topic == essential;
}

std::optional<StandIn> standInFor(std::string_view service,
                                  const std::vector<RemoteEndpoint>& endpoints,
                                  const std::string& prefix) {
  for (const RemoteEndpoint& endpoint : endpoints) {
    if (!endpoint.writer || !endpoint.wire_name.starts_with(prefix)) continue;
    const std::string topic = endpoint.wire_name.substr(prefix.size());
    if (standsIn(service, topic, endpoint.process)) return StandIn{endpoint.process, topic};
  }
  return std::nullopt;
}

Discovery::Discovery(const Participant& participant)
    : participants_(builtinReader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT)),
      writers_(builtinReader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION)),
      readers_(builtinReader(participant, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION)) {}

std::vector<std::string> Discovery::participants() {
  std::vector<std::string> names;
  readAll<dds_builtintopic_participant_t>(
      participants_, [&](const auto& sample) { names.push_back(nameOf(sample.qos)); });
  return names;
}

std::vector<RemoteEndpoint> Discovery::endpoints() {
  std::map<Guid, std::string> processes;
  readAll<dds_builtintopic_participant_t>(participants_, [&](const auto& sample) {
    processes[guidOf(sample.key)] = nameOf(sample.qos);
  });
  std::vector<RemoteEndpoint> result;
  for (const bool writer : {true, false}) {
    readAll<dds_builtintopic_endpoint_t>(writer ? writers_ : readers_, [&](const auto& sample) {
      result.push_back(
          {sample.topic_name, sample.type_name, processes[guidOf(sample.participant_key)], writer});
    });
  }
  return result;
}

}  // namespace perdure::bus
