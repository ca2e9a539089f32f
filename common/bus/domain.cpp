#include "common/bus/domain.h"

#include <cstdlib>
#include <utility>

#include "common/base/errors.h"
#include "common/bus/dds.h"
#include "common/bus/shared_memory.h"

namespace perdure::bus {
namespace {

/// Highest index of a participant without multicast: so many processes fit on one host.
constexpr int kMaxParticipantIndex = 60;
constexpr double kMostSharedMemory = 256;  // MB; wire/bounds.h allows no larger images

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

/// CYCLONEDDS_URI, where it says something.
const char* givenConfiguration() {
  const char* uri = std::getenv("CYCLONEDDS_URI");
  return uri != nullptr && *uri != '\0' ? uri : nullptr;
}

bool isInterfaceName(const std::string& name) {
  return !name.empty() && name.find_first_of("<>&\"' \t\n") == std::string::npos;
}

/// Deleted before its parent is.
std::shared_ptr<const Entity> keptBy(std::shared_ptr<const Entity> parent, Entity entity) {
  struct Kept {
    std::shared_ptr<const Entity> parent;  // goes last
    Entity entity;
  };
  auto kept = std::make_shared<const Kept>(Kept{std::move(parent), std::move(entity)});
  return {kept, &kept->entity};
}

SharedMemory findSharedMemory(const Options& options) {
  if (options.shared_memory_mb == 0) return {};
  if (givenConfiguration() != nullptr) {
    return {{}, "CYCLONEDDS_URI, which is set, goes before bus.shared_memory_mb"};
  }
  constexpr std::size_t kAround = 1024;  // what is in a message beside its pixels
  const auto locator = sharedMemoryLocator();
  if (!locator) return {{}, locator.error().detail};
  return {*locator, {}, (static_cast<std::size_t>(options.shared_memory_mb) << 20) - kAround};
}

std::int32_t createDomain(const Options& options, const std::string& locator) {
  if (!isInterfaceName(options.interface)) {
    throw StartupError(ExitCode::kConfiguration,
                       "bus.interface: \"" + options.interface + "\" is not an interface's name");
  }
  const char* given = givenConfiguration();
  const std::string configuration = given != nullptr ? given : configurationXml(options, locator);
  const auto id = static_cast<dds_domainid_t>(options.domain);
  const dds_entity_t domain = dds_create_domain(id, configuration.c_str());
  if (domain < 0) {
    throw StartupError(
        ExitCode::kUnavailable,
        "DDS cannot open domain " + std::to_string(options.domain) + " on interface " +
            options.interface + " (" + dds_strretcode(-domain) +
            "); bus.interface names an interface that `ip link` shows as up" +
            (given != nullptr ? ", and CYCLONEDDS_URI, which is set, goes before it" : ""));
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
  fields.integer("bus.shared_memory_mb", options.shared_memory_mb,
                 config::between(0, kMostSharedMemory),
                 {"largest image that goes through shared memory, where iox-roudi runs with chunks "
                  "of that size; 0: none does",
                  "MB"});
}

Options withEnvironment(Options options) {
  if (const char* domain = std::getenv("PERDURE_DOMAIN")) {
    options.domain = std::strtol(domain, nullptr, 10);
  }
  return options;
}

std::string configurationXml(const Options& options, const std::string& locator) {
  const bool loopback = options.interface == "lo";
  const std::string id = options.domain == 0 ? "any" : std::to_string(options.domain);
  return "<CycloneDDS><Domain Id=\"" + id + "\">" +
         (loopback ? loopbackXml() : networkXml(options.interface)) +
         "<Internal><SocketReceiveBufferSize max=\"10MB\"/>"
         "<Watermarks><WhcHigh>32MB</WhcHigh></Watermarks></Internal>"
         "<SharedMemory><Enable>" +
         (locator.empty()
              ? "false</Enable>"
              : "true</Enable><Locator>" + locator + "</Locator><LogLevel>error</LogLevel>") +
         "</SharedMemory>"
         "</Domain></CycloneDDS>";
}

Domain::Domain(const Options& options)
    : options_(withEnvironment(options)),
      shared_memory_(findSharedMemory(options_)),
      domain_(keptBy(nullptr, Entity(createDomain(options_, shared_memory_.locator)))) {}

std::string Domain::sharedMemoryText() const {
  if (options_.shared_memory_mb == 0) return {};
  if (!shared_memory_.on()) return "no shared memory: " + shared_memory_.why_not;
  const auto now = sharedMemoryLocator();
  if (!now)
    return "RouDi is gone: who starts now shares no memory; start it and the services again";
  if (*now != shared_memory_.locator) {
    return "RouDi was started anew: who starts now meets this process over the network interface; "
           "start the services again";
  }
  return "images go through shared memory";
}

bool Domain::sharesMemory() const {
  const auto now = sharedMemoryLocator();
  return shared_memory_.on() && now && *now == shared_memory_.locator;
}

Participant::Participant(const Domain& domain, const std::string& process)
    : shared_memory_(domain.sharedMemory()), prefix_("perdure/" + domain.options().vehicle + "/") {
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
  participant_ = keptBy(domain.entity(), Entity(participant));
}

std::shared_ptr<const Entity> Participant::keep(Entity entity) const {
  return keptBy(participant_, std::move(entity));
}

}  // namespace perdure::bus
