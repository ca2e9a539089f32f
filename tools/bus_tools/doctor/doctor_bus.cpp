#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>

#include "common/base/errors.h"
#include "common/bus/discovery.h"
#include "tools/bus_tools/common.h"
#include "tools/bus_tools/doctor/doctor.h"

namespace perdure::tools {
namespace {

Findings checkUsualServices(const std::vector<std::string>& participants,
                            const std::vector<bus::RemoteEndpoint>& endpoints,
                            const std::string& prefix) {
  Findings findings;
  for (const char* service : kUsualServices) {
    const auto n = std::ranges::count(participants, service);
    if (n > 0) {
      findings.push_back({Verdict::kOk, std::string(service) + " is on the bus" +
                                            (n > 1 ? " " + std::to_string(n) + " times" : "")});
    } else if (const auto other = bus::standInFor(service, endpoints, prefix)) {
      findings.push_back({Verdict::kOk, std::string(service) + " is not on the bus; " +
                                            other->process + " stands in for it: it writes " +
                                            other->topic});
    } else {
      findings.push_back({Verdict::kWarn, std::string(service) +
                                              " is not on the bus; is it running, with the same "
                                              "bus.interface and bus.domain?"});
    }
  }
  return findings;
}

Finding checkCount(std::size_t participants) {
  constexpr std::size_t kMany = 50;  // warns early: without multicast, at most 61 participants fit
  const std::string text = std::to_string(participants) + " participants on the bus";
  if (participants < kMany) return {Verdict::kOk, text};
  return {Verdict::kWarn, text + "; near the limit of 61: another bus.domain parts them"};
}

/// Finds endpoints whose type name is not that of the topic. DDS drops their samples silently.
Findings checkTypes(const std::vector<bus::RemoteEndpoint>& endpoints, const std::string& prefix) {
  Findings findings;
  for (const bus::RemoteEndpoint& endpoint : endpoints) {
    if (!endpoint.wire_name.starts_with(prefix)) continue;
    const std::string topic = endpoint.wire_name.substr(prefix.size());
    const bus::TopicInfo* info = bus::findTopic(topic);
    if (info == nullptr || info->typeName() == endpoint.type_name) continue;
    findings.push_back({Verdict::kFail, endpoint.process + " has " + topic + " with type " +
                                            endpoint.type_name + " instead of " + info->typeName() +
                                            "; build it from our idl/"});
  }
  return findings;
}

Finding findingOf(const Health& health) {
  constexpr std::array kVerdicts{Verdict::kWarn, Verdict::kOk, Verdict::kWarn, Verdict::kFail};
  constexpr std::array kWords{"is starting", "is well", "is degraded", "has failed"};
  return {kVerdicts.at(static_cast<std::size_t>(health.state)),
          health.process + " (pid " + std::to_string(health.pid) + ") " +
              nameAt(kWords, health.state) + (health.message.empty() ? "" : ": " + health.message)};
}

/// Reports counts that indicate a misconfiguration or lost data; normal filter events are ignored.
Findings checkCounts(const Health& health) {
  Findings findings;
  for (const auto& [reason, n] : health.reasons) {
    const auto contains = [&reason = reason](const char* word) {
      return reason.find(word) != std::string::npos;
    };
    const std::string text = health.process + " counts " + reason + ": " + std::to_string(n);
    if (contains("_incompatible_qos")) {
      findings.push_back(
          {Verdict::kFail, text + "; the other side must use the table of `perdure topics`"});
    } else if (contains("_malformed_") || contains("_refused_")) {
      findings.push_back({Verdict::kWarn, text + "; `perdure topics` shows who writes it"});
    } else if (contains("_sample_lost") || contains("_write_timeout")) {
      findings.push_back(
          {Verdict::kWarn, text + "; raise net.core.rmem_max or free the processor"});
    }
  }
  return findings;
}

void append(Findings& to, const Findings& more) { to.insert(to.end(), more.begin(), more.end()); }

}  // namespace

Findings checkBus(const bus::Options& options, double seconds) {
  Findings findings;
  if (const char* uri = std::getenv("CYCLONEDDS_URI"); uri != nullptr && *uri != '\0') {
    findings.push_back({Verdict::kOk, "CYCLONEDDS_URI is set and overrides bus.interface"});
  }
  try {
    const bus::Domain domain(options);
    const bus::Participant participant(domain, "perdure doctor");
    bus::Discovery discovery(participant);
    bus::Reader<Health> reader(participant, bus::kTopic<Health>);
    bus::WaitLoop loop(participant);
    std::map<std::string, Health> processes;
    loop.on(reader, [&](const Health& m) { processes[m.process] = m; });
    runLoop(loop, seconds);
    const std::vector<std::string> participants = discovery.participants();
    findings.push_back(checkCount(participants.size()));
    const std::vector<bus::RemoteEndpoint> endpoints = discovery.endpoints();
    append(findings, checkUsualServices(participants, endpoints, participant.wireName("")));
    append(findings, checkTypes(endpoints, participant.wireName("")));
    for (const auto& [name, health] : processes) {
      findings.push_back(findingOf(health));
      append(findings, checkCounts(health));
    }
  } catch (const StartupError& error) {
    findings.push_back({Verdict::kFail, error.what()});
  }
  return findings;
}

}  // namespace perdure::tools
