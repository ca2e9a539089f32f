#include "common/bus/domain.h"

#include <cstdlib>
#include <utility>

#include "common/base/errors.h"
#include "common/bus/dds.h"

namespace perdure::bus {
namespace {

/// Highest index of a participant without multicast: so many processes fit on one host.
constexpr int kMaxParticipantIndex = 60;

std::string loopbackXml() {
  // Unicast only; large fragments and buffers, because nothing can be lost between hosts.
  return "<General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>"
         "<AllowMulticast>false</AllowMulticast>"
         "<MaxMessageSize>65500B</MaxMessageSize><FragmentSize>65000B</FragmentSize></General>"
         "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
         "<MaxAutoParticipantIndex>" +
         std::to_string(kMaxParticipantIndex) +
         "</MaxAutoParticipantIndex>"
         "<Peers><Peer Address=\"127.0.0.1\"/></Peers></Discovery>";
}

std::string networkXml(const std::string& interface) {
  return "<General><Interfaces><NetworkInterface name=\"" + interface +
         "\"/></Interfaces></General>"
         "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>" +
         std::to_string(kMaxParticipantIndex) + "</MaxAutoParticipantIndex></Discovery>";
}

bool isInterfaceName(const std::string& name) {
  return !name.empty() && name.find_first_of("<>&\"' \t\n") == std::string::npos;
}

std::int32_t createDomain(const Options& options) {
  if (!isInterfaceName(options.interface)) {
    throw StartupError(ExitCode::kConfiguration,
                       "bus.interface: \"" + options.interface + "\" is not an interface's name");
  }
  const char* uri = std::getenv("CYCLONEDDS_URI");
  const bool given = uri != nullptr && *uri != '\0';
  const std::string configuration = given ? uri : configurationXml(options);
  const auto id = static_cast<dds_domainid_t>(options.domain);
  const dds_entity_t domain = dds_create_domain(id, configuration.c_str());
  if (domain < 0) {
    throw StartupError(ExitCode::kUnavailable,
                       "DDS cannot open domain " + std::to_string(options.domain) +
                           " on interface " + options.interface + " (" + dds_strretcode(-domain) +
                           "); bus.interface names an interface that `ip link` shows as up" +
                           (given ? ", and CYCLONEDDS_URI, which is set, goes before it" : ""));
  }
  return domain;
}

}  // namespace

Entity::~Entity() {
  if (handle_ > 0) dds_delete(handle_);
}

Entity& Entity::operator=(Entity&& other) noexcept {
  std::swap(handle_, other.handle_);
  return *this;
}

void describe(Options& options, config::Fields& fields) {
  constexpr double kMaxDomain = 230;  // ports end there
  fields.text("bus.interface", options.interface,
              {"network interface of the topics: lo, or one that other hosts are on"});
  fields.integer("bus.domain", options.domain, config::between(0, kMaxDomain),
                 {"DDS domain; the variable PERDURE_DOMAIN goes before it"});
  fields.text("bus.vehicle", options.vehicle, {"the vehicle's name in the topics' names"});
}

Options withEnvironment(Options options) {
  if (const char* domain = std::getenv("PERDURE_DOMAIN")) {
    options.domain = std::strtol(domain, nullptr, 10);
  }
  return options;
}

std::string configurationXml(const Options& options) {
  const bool loopback = options.interface == "lo";
  const std::string id = options.domain == 0 ? "any" : std::to_string(options.domain);
  return "<CycloneDDS><Domain Id=\"" + id + "\">" +
         (loopback ? loopbackXml() : networkXml(options.interface)) +
         "<Internal><SocketReceiveBufferSize max=\"10MB\"/>"
         "<Watermarks><WhcHigh>32MB</WhcHigh></Watermarks></Internal>"
         "<SharedMemory><Enable>false</Enable></SharedMemory>"
         "</Domain></CycloneDDS>";
}

Domain::Domain(const Options& options)
    : options_(withEnvironment(options)), domain_(createDomain(options_)) {}

Participant::Participant(const Domain& domain, const std::string& process)
    : prefix_("perdure/" + domain.options().vehicle + "/") {
  const QosPtr qos(dds_create_qos());
  dds_qset_entity_name(qos.get(), process.c_str());
  const auto id = static_cast<dds_domainid_t>(domain.options().domain);
  const dds_entity_t participant = dds_create_participant(id, qos.get(), nullptr);
  if (participant < 0) {
    throw StartupError(ExitCode::kUnavailable,
                       std::string("DDS cannot create a participant (") +
                           dds_strretcode(-participant) + "); are more than " +
                           std::to_string(kMaxParticipantIndex) +
                           " processes running in this domain? Another bus.domain is free");
  }
  participant_ = Entity(participant);
}

}  // namespace perdure::bus
