#include "common/bus/domain.h"

#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string_view>
#include <utility>

#include "common/base/errors.h"
#include "common/bus/dds.h"
#include "common/bus/interfaces.h"
#include "common/bus/security/roles.h"
#include "common/bus/security_log.h"
#include "common/bus/shared_memory.h"

namespace perdure::bus {
namespace {

/// The highest index of a participant. It limits the number of processes on one host.
constexpr int kMaxParticipantIndex = 60;
constexpr double kMostSharedMemory = 256;  // MB; common/types/description.h allows no larger images

/// Cyclone's id, in this process only, of the domain for third-party programs.
constexpr std::int64_t kForeignId = 1000;

std::string indexXml() {
  return "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>" +
         std::to_string(kMaxParticipantIndex) + "</MaxAutoParticipantIndex>";
}

std::string loopbackXml() {
  // Loopback uses unicast only. Fragments are large, because loopback loses no data.
  return "<General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>"
         "<AllowMulticast>false</AllowMulticast>"
         "<MaxMessageSize>65500B</MaxMessageSize><FragmentSize>65000B</FragmentSize></General>"
         "<Discovery>" +
         indexXml() + "<Peers><Peer Address=\"127.0.0.1\"/></Peers></Discovery>";
}

/// Requests and resends lost data within a frame's period. With Cyclone's default of 100 ms, each
/// lost fragment would double the age of an image.
constexpr char kResendSoon[] =
    "<NackDelay>5ms</NackDelay><HeartbeatInterval>20ms</HeartbeatInterval>";

/// Returns the unicast addresses of this host and of `peers`; "" without peers.
std::string peersXml(const std::string& interface, const std::vector<std::string>& peers) {
  if (peers.empty()) return {};
  std::string xml = "<Peers><Peer Address=\"" + addressOf(interface) + "\"/>";
  for (const std::string& peer : peers) xml += "<Peer Address=\"" + peer + "\"/>";
  return xml + "</Peers>";
}

/// After an absence longer than the lease (10 s), a host is found within 2 s, not within 30 s.
constexpr char kMeetSoon[] = "<SPDPInterval>2s</SPDPInterval>";

/// Third-party programs (`foreign`) use multicast for discovery only, like Fast DDS.
std::string networkXml(const Options& options, bool foreign) {
  std::string xml = "<General><Interfaces>";
  std::istringstream interfaces(options.interface);
  for (std::string one; std::getline(interfaces, one, ',');) {
    // Linux sends multicast over loopback, but does not set its flag.
    xml += "<NetworkInterface name=\"" + one + (one == "lo" ? "\" multicast=\"true" : "") + "\"/>";
  }
  const std::string first = options.interface.substr(0, options.interface.find(','));
  return xml + "</Interfaces><AllowMulticast>" +
         (!options.peers.empty() ? "false"
          : foreign              ? "spdp"
                                 : "true") +
         "</AllowMulticast></General><Discovery>" + indexXml() + kMeetSoon +
         (foreign ? "<ExternalDomainId>" + std::to_string(options.domain) + "</ExternalDomainId>"
                  : "") +
         peersXml(first, options.peers) + "</Discovery>";
}

std::string domainXml(const Options& options, const std::string& locator, const std::string& beside,
                      bool foreign = false) {
  const bool loopback = options.interface == "lo" && !foreign;
  const bool any = options.domain == 0 || foreign;
  return "<CycloneDDS><Domain Id=\"" + (any ? "any" : std::to_string(options.domain)) + "\">" +
         (loopback ? loopbackXml() : networkXml(options, foreign)) +
         "<Internal><SocketReceiveBufferSize max=\"10MB\"/>" + (loopback ? "" : kResendSoon) +
         "<Watermarks><WhcHigh>32MB</WhcHigh></Watermarks></Internal>"
         "<SharedMemory><Enable>" +
         (locator.empty()
              ? "false</Enable>"
              : "true</Enable><Locator>" + locator + "</Locator><LogLevel>error</LogLevel>") +
         "</SharedMemory>" + beside + "</Domain></CycloneDDS>";
}

std::string identityFolder(const Options& options, const std::string& process) {
  return options.security + "/" +
         (options.identity.empty() ? identityOf(process) : options.identity);
}

/// Returns CYCLONEDDS_URI, or nullptr if it is not set or empty.
const char* givenConfiguration() {
  const char* uri = std::getenv("CYCLONEDDS_URI");
  return uri != nullptr && *uri != '\0' ? uri : nullptr;
}

bool isPlainName(const std::string& name) {
  return !name.empty() && name.find_first_of("<>&\"' \t\n") == std::string::npos;
}

/// Throws StartupError if an interface or a peer is not a name. `group`: prefix of the keys in the
/// message, "bus" or "ros".
void requireNames(const std::string& group, const Options& options) {
  if (!isPlainName(options.interface)) {
    throw StartupError(ExitCode::kConfiguration, group + ".interface: \"" + options.interface +
                                                     "\" is not an interface's name");
  }
  for (const std::string& peer : options.peers) {
    if (isPlainName(peer)) continue;
    throw StartupError(ExitCode::kConfiguration,
                       group + ".peers: \"" + peer + "\" is no address and no host's name");
  }
}

/// Returns an entity that keeps its parent alive, and is deleted before it.
std::shared_ptr<const Entity> keptBy(std::shared_ptr<const Entity> parent, Entity entity) {
  struct Kept {
    std::shared_ptr<const Entity> parent;  // destroyed last
    Entity entity;
  };
  auto kept = std::make_shared<const Kept>(Kept{std::move(parent), std::move(entity)});
  return {kept, &kept->entity};
}

/// Throws StartupError if both security and shared memory are on: data in shared memory are neither
/// encrypted nor restricted to some participants.
void refuseOpenMemory(const Options& options) {
  if (options.security.empty() || options.shared_memory_mb == 0) return;
  throw StartupError(ExitCode::kConfiguration,
                     "bus.security and bus.shared_memory_mb are both set, but what goes through "
                     "shared memory is open to all who reach RouDi; set one of them only");
}

SharedMemory findSharedMemory(const Options& options) {
  refuseOpenMemory(options);
  if (options.shared_memory_mb == 0) return {};
  if (givenConfiguration() != nullptr) {
    return {{}, "CYCLONEDDS_URI is set and overrides bus.shared_memory_mb"};
  }
  constexpr std::size_t kAround = 1024;  // bytes; largest size of a message without pixels
  const auto locator = sharedMemoryLocator();
  if (!locator) return {{}, locator.error().detail};
  return {*locator, {}, (static_cast<std::size_t>(options.shared_memory_mb) << 20) - kAround};
}

std::int32_t createDomain(std::int64_t id, const Options& options, const std::string& configuration,
                          const std::string& fix) {
  const dds_entity_t domain =
      dds_create_domain(static_cast<dds_domainid_t>(id), configuration.c_str());
  if (domain >= 0) return domain;
  throw StartupError(ExitCode::kUnavailable, "DDS cannot open domain {} on interface {} ({}); {}",
                     options.domain, options.interface, dds_strretcode(-domain), fix);
}

std::int32_t createDomain(const Options& options, const std::string& locator) {
  requireNames("bus", options);
  const char* given = givenConfiguration();
  if (!options.security.empty()) (void)securityLog(given == nullptr);
  return createDomain(options.domain, options,
                      given != nullptr ? given : configurationXml(options, locator),
                      std::string("bus.interface names an interface that `ip link` shows as up") +
                          (given != nullptr ? "; CYCLONEDDS_URI, which is set, overrides it" : ""));
}

/// Assigns the identity in `folder` to a participant. The properties of the identity take
/// precedence over the security settings in CYCLONEDDS_URI.
Identity secure(dds_qos_t& qos, const std::string& folder) {
  const auto identity = readIdentity(folder);
  if (!identity) {
    throw StartupError(ExitCode::kUnavailable, "bus.security: " + identity.error().detail);
  }
  for (const auto& [name, value] : securityProperties(folder)) {
    dds_qset_prop(&qos, name.c_str(), value.c_str());
  }
  return *identity;
}

[[noreturn]] void refuseParticipant(dds_return_t code, const std::optional<Identity>& identity) {
  const std::string refused =
      std::string("DDS cannot create a participant (") + dds_strretcode(-code) + ")";
  if (identity && code != DDS_RETCODE_OUT_OF_RESOURCES) {
    throw StartupError(ExitCode::kUnavailable,
                       "{}; {}; is the identity {} for this bus.domain? `perdure security renew` "
                       "makes it anew; Cyclone's plugins are in Debian's libddsc0debian",
                       refused, securityLog().own(), identity->name);
  }
  throw StartupError(ExitCode::kUnavailable, refused + "; are more than " +
                                                 std::to_string(kMaxParticipantIndex) +
                                                 " processes running in this domain? Another "
                                                 "bus.domain is free");
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
  fields.text("bus.interface", options.interface,
              {"network interface of the topics: lo, or that of the network with the other hosts"});
  fields.texts(
      "bus.peers", options.peers,
      {"addresses of the other hosts, if multicast does not reach them; empty: multicast"});
  fields.integer("bus.domain", options.domain, config::between(0, double{kMaxDomain}),
                 {"DDS domain; the variable PERDURE_DOMAIN overrides it"});
  fields.text("bus.vehicle", options.vehicle, {"name of the vehicle in the names of the topics"});
  fields.integer(
      "bus.shared_memory_mb", options.shared_memory_mb, config::between(0, kMostSharedMemory),
      {"largest image that is sent through shared memory; requires iox-roudi with chunks of "
       "this size; 0: no image",
       "MB"});
  fields.text("bus.security", options.security,
              {"folder of the identities of `perdure security`; processes without an identity are "
               "refused; empty: the bus is open"});
  fields.text("bus.identity", options.identity,
              {"name of the identity, a folder in bus.security; empty: the name of the service"});
}

Options commonOptions(const std::string& folder, std::vector<config::Problem>& problems) {
  Options options;
  const char* given = std::getenv("PERDURE_BUS");
  const std::string beside = folder.empty() ? "" : folder + "/bus.yaml";
  const std::string file = given != nullptr ? given : beside;
  std::error_code ignored;
  if (file.empty() || (given == nullptr && !std::filesystem::exists(file, ignored))) return options;
  config::Fields fields;
  describe(options, fields);
  const auto found = config::readFile(fields, file);
  problems.insert(problems.end(), found.begin(), found.end());
  return options;
}

Options withEnvironment(Options options) {
  const char* given = std::getenv("PERDURE_DOMAIN");
  if (given == nullptr || *given == '\0') return options;
  const std::string_view text = given;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), options.domain);
  if (error != std::errc() || end != text.data() + text.size()) options.domain = -1;
  if (options.domain < 0 || options.domain > kMaxDomain) {
    throw StartupError(ExitCode::kConfiguration,
                       "PERDURE_DOMAIN is `{}`, which is not a whole number 0 … {}; correct it, "
                       "or unset it: bus.domain is used then",
                       text, kMaxDomain);
  }
  return options;
}

std::string configurationXml(const Options& options, const std::string& locator) {
  // securityLog() receives the trace, so it is not written to a file.
  return domainXml(options, locator,
                   options.security.empty() ? ""
                                            : "<Tracing><Category>discovery</Category>"
                                              "<OutputFile>stderr</OutputFile></Tracing>");
}

std::string foreignXml(const Options& options) {
  const bool secure = !options.security.empty() && !options.identity.empty();
  return domainXml(options, {}, secure ? securityXml(identityFolder(options, {})) : std::string());
}

Domain::Domain(const Options& options)
    : Domain(withEnvironment(options), findSharedMemory(withEnvironment(options))) {}

Domain::Domain(Options options, SharedMemory memory)
    : options_(std::move(options)),
      shared_memory_(std::move(memory)),
      id_(options_.domain),
      domain_(keptBy(nullptr, Entity(createDomain(options_, shared_memory_.locator)))) {}

Domain::Domain(Options options, std::int64_t id, Entity domain)
    : options_(std::move(options)), id_(id), domain_(keptBy(nullptr, std::move(domain))) {}

Domain Domain::foreign(Options options) {
  options.security.clear();
  if (givenConfiguration() != nullptr) {
    // Cyclone itself opens the domain for the first participant.
    options.interface = "CYCLONEDDS_URI";
    return {options, options.domain, Entity()};
  }
  if (options.interface.empty()) options.interface = interfacesUp();
  requireNames("ros", options);
  Entity domain(createDomain(kForeignId, options, domainXml(options, {}, {}, true),
                             "ros.interface names interfaces that `ip link` shows as up"));
  return {std::move(options), kForeignId, std::move(domain)};
}

Domain Domain::as(std::string vehicle, std::string security, std::string identity) const {
  Domain same = *this;
  same.options_.vehicle = std::move(vehicle);
  same.options_.security = std::move(security);
  same.options_.identity = std::move(identity);
  return same;
}

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
  const Options& options = domain.options();
  const QosPtr qos(dds_create_qos());
  dds_qset_entity_name(qos.get(), process.c_str());
  if (!options.security.empty()) {
    identity_ = secure(*qos, identityFolder(options, process));
  }
  const auto id = static_cast<dds_domainid_t>(domain.id());
  const dds_entity_t participant = dds_create_participant(id, qos.get(), nullptr);
  if (participant < 0) refuseParticipant(participant, identity_);
  participant_ = keptBy(domain.entity(), Entity(participant));
}

std::shared_ptr<const Entity> Participant::keep(Entity entity) const {
  return keptBy(participant_, std::move(entity));
}

}  // namespace perdure::bus
