// Tests a closed bus with real processes: the five services with their own identities, and foreign
// programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <set>

#include "common/bus/discovery.h"
#include "common/bus/wait_loop.h"
#include "tests/process/support.h"
#include "tests/services/run_until.h"
#include "tools/security/authority.h"

namespace perdure::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using tools::Authority;
using tools::validFor;

constexpr const char* kServices[] = {"capture", "vio", "inference", "semantic_filter", "map_store"};

/// A folder of identities, and a bus.yaml with bus.security as its only setting, which closes the
/// bus for all child processes.
class ClosedBus {
 public:
  ClosedBus() {
    (void)ownNetwork();
    for (const bus::RoleName& role : bus::roleNames()) {
      const std::string name(role.name);
      authority_.add({.name = name, .role = name}, validFor(30));
    }
    std::ofstream(file("bus.yaml")) << "bus:\n  security: " << dir() << "\n";
    setenv("PERDURE_BUS", file("bus.yaml").c_str(), 1);
  }
  ~ClosedBus() { unsetenv("PERDURE_BUS"); }
  ClosedBus(const ClosedBus&) = delete;
  ClosedBus& operator=(const ClosedBus&) = delete;

  std::string file(const std::string& name) const { return folder_.file(name); }
  std::string dir() const { return file("security"); }
  Authority& authority() { return authority_; }
  bus::Options options() const {
    bus::Options options = ownNetwork();
    options.security = dir();
    return options;
  }

  std::unique_ptr<Child> service(const std::string& name, std::vector<std::string> settings) {
    std::string program = "perdure-" + name;
    for (char& c : program) c = c == '_' ? '-' : c;
    std::vector<std::string> command = {(programs() / program).string()};
    for (const std::string& setting : settings) {
      command.insert(command.end(), {"--set", setting});
    }
    return std::make_unique<Child>(command, file(name + ".log"));
  }
  std::unique_ptr<Child> filter(std::vector<std::string> more = {}) {
    more.push_back("class_priors=" + (sources() / "config/class_priors.yaml").string());
    more.push_back("restore.timeout_s=0.5");
    return service("semantic_filter", more);
  }
  std::unique_ptr<Child> mapStore(std::vector<std::string> more = {}) {
    more.push_back("store.path=" + file("map.sqlite"));
    return service("map_store", more);
  }
  /// The `perdure` command.
  std::unique_ptr<Child> tool(std::vector<std::string> words) {
    words.insert(words.begin(), (programs() / "perdure").string());
    return std::make_unique<Child>(words, file("tool.log"));
  }

 private:
  Folder folder_;
  Authority authority_ = Authority::create(folder_.file("security"), "ego", 3650);
};

/// The operator's participant, in this process.
class Watcher {
 public:
  explicit Watcher(const bus::Options& options) : domain_(options) {
    loop_.on(health_reader_, [this](const Health& h) { health_[h.process] = h; });
    loop_.on(objects_reader_, [this](const Objects&) { ++objects_; });
    loop_.on(detections_reader_, [this](const Detections&) { ++detections_; });
  }
  bool until(const std::function<bool()>& so) { return runUntil(loop_, so, 40s); }
  const Health& health(const std::string& process) { return health_[process]; }
  std::uint64_t reason(const std::string& process, const std::string& name) {
    const auto& reasons = health_[process].reasons;
    return reasons.contains(name) ? reasons.at(name) : 0;
  }
  int objects() const { return objects_; }
  int detections() const { return detections_; }
  std::size_t writersOfDetections() const { return detections_reader_.matched(); }
  bus::Discovery& discovery() { return discovery_; }

 private:
  bus::Domain domain_;
  bus::Participant participant_{domain_, "perdure test"};
  bus::Discovery discovery_{participant_};
  bus::Reader<Health> health_reader_{participant_, bus::kTopic<Health>};
  bus::Reader<Objects> objects_reader_{participant_, bus::kTopic<Objects>};
  bus::Reader<Detections> detections_reader_{participant_, bus::kTopic<Detections>};
  bus::WaitLoop loop_{participant_};
  std::map<std::string, Health> health_;
  int objects_ = 0, detections_ = 0;
};

using Uses = std::set<std::string>;  // "vio writes odometry"

Uses granted() {
  Uses uses;
  for (const bus::TopicInfo& info : bus::topicTable()) {
    const std::string topic(info.name);
    for (const bus::RoleName& role : bus::roleNames()) {
      const std::string name(role.name);
      if (std::find(std::begin(kServices), std::end(kServices), name) == std::end(kServices)) {
        continue;
      }
      if (info.writers.has(role.role)) uses.insert(name + " writes " + topic);
      if (info.readers.has(role.role)) uses.insert(name + " reads " + topic);
    }
  }
  // vio reads odometry only with given poses (see KnownPosesProcess)
  uses.erase("vio reads odometry");
  return uses;
}

Uses used(bus::Discovery& discovery) {
  Uses uses;
  const std::string prefix = "perdure/ego/";
  for (const bus::RemoteEndpoint& endpoint : discovery.endpoints()) {
    if (!endpoint.wire_name.starts_with(prefix) || endpoint.process == "perdure test") continue;
    const std::string topic = endpoint.wire_name.substr(prefix.size());
    uses.insert(endpoint.process + (endpoint.writer ? " writes " : " reads ") +
                (topic.starts_with("frame/") ? "frame/" : topic));
  }
  return uses;
}

Uses without(const Uses& all, const Uses& some) {
  Uses rest;
  std::set_difference(all.begin(), all.end(), some.begin(), some.end(),
                      std::inserter(rest, rest.end()));
  return rest;
}

TEST(ClosedBus, CarriesTheFiveServicesWhichUseAllThatIsGrantedAndNoMore) {
  ClosedBus bus;
  const auto simulate = bus.tool({"simulate", "--scene", "street", "--seconds", "4", "--size",
                                  "160x120", "--mono", "--quiet", "--out", bus.file("drive")});
  ASSERT_EQ(simulate->wait(60s), 0) << simulate->log();
  Watcher watcher(bus.options());
  const auto map_store = bus.mapStore();
  const auto filter = bus.filter();
  const auto inference = bus.service(
      "inference", {"model.path=" + (sources() / "models/perdure_320x240.onnx").string()});
  const auto vio =
      bus.service("vio", {"state.directory=" + bus.file("state"), "input.moving_mask=true"});
  const auto capture = bus.service("capture", {"dataset.path=" + bus.file("drive"),
                                               "start.readers=[vio, inference, semantic_filter]"});
  EXPECT_TRUE(watcher.until([&] { return watcher.objects() > 20; }))
      << capture->log() << vio->log() << inference->log() << filter->log() << map_store->log();
  EXPECT_TRUE(watcher.until([&] { return used(watcher.discovery()) == granted(); }));
  EXPECT_THAT(without(granted(), used(watcher.discovery())), IsEmpty()) << "granted in vain";
  EXPECT_THAT(without(used(watcher.discovery()), granted()), IsEmpty());
  EXPECT_GT(watcher.detections(), 0);
  for (const char* service : kServices) {
    EXPECT_EQ(watcher.health(service).process, service);
    EXPECT_EQ(watcher.reason(service, "security_refused_no_certificate"), 0u);
  }
}

/// Returns the XML configuration of a foreign program with this identity.
std::string foreign(const ClosedBus& bus, const std::string& identity) {
  bus::Options options = bus.options();
  options.identity = identity;
  return bus::foreignXml(options);
}

class Strangers : public ::testing::Test {
 protected:
  Strangers() {
    EXPECT_TRUE(watcher_.until([&] { return watcher_.health("semantic_filter").pid != 0; }))
        << filter_->log();
  }
  /// Starts a program that writes detections at 20 Hz with its own configuration.
  std::unique_ptr<Child> writer(const std::string& xml) {
    return std::make_unique<Child>(
        std::vector<std::string>{"env", "CYCLONEDDS_URI=" + xml, std::getenv("PERDURE_BUS_PEER"),
                                 "detections", "50"},
        bus_.file("peer.log"));
  }
  bool refused(const std::string& reason) {
    return watcher_.until(
        [&] { return watcher_.reason("semantic_filter", "security_refused_" + reason) > 0; });
  }
  /// Waits until any accepted writer would have been received (see the inference test below).
  void listen() {
    const auto end = std::chrono::steady_clock::now() + 2s;
    (void)watcher_.until([&] { return std::chrono::steady_clock::now() > end; });
  }
  void expectUnheard() {
    EXPECT_EQ(watcher_.writersOfDetections(), 0u);
    EXPECT_EQ(watcher_.detections(), 0);
    for (const auto& [reason, n] : watcher_.health("semantic_filter").reasons) {
      EXPECT_TRUE(reason.starts_with("security_refused_")) << reason;
    }
  }

  ClosedBus bus_;
  Watcher watcher_{bus_.options()};
  std::unique_ptr<Child> filter_ = bus_.filter();
};

using LongStrangers = Strangers;

TEST_F(LongStrangers, WithTheRightIdentityAreNone) {
  const auto peer = writer(foreign(bus_, "inference"));
  EXPECT_TRUE(watcher_.until([&] { return watcher_.detections() > 5; })) << peer->log();
  EXPECT_EQ(watcher_.writersOfDetections(), 1u);
}

TEST_F(Strangers, WithoutACertificateMatchNothingReadNothingWriteNothing) {
  const auto peer = writer(bus::configurationXml(ownNetwork()));
  unsetenv("PERDURE_BUS");
  const auto echo = bus_.tool({"echo", "health", "--seconds", "3"});
  EXPECT_TRUE(refused("no_certificate"));
  EXPECT_EQ(echo->wait(10s), 0);
  EXPECT_THAT(echo->log(), IsEmpty());
  expectUnheard();
}

TEST_F(LongStrangers, OfAnotherAuthorityMatchNothingReadNothingWriteNothing) {
  Authority rogue = Authority::create(bus_.file("rogue"), "ego", 30);
  for (const char* name : {"inference", "operator"}) {
    rogue.add({.name = name, .role = name}, validFor(30));
  }
  bus::Options options = ownNetwork();
  options.security = bus_.file("rogue");
  options.identity = "inference";
  const auto peer = writer(bus::foreignXml(options));
  const auto echo =
      bus_.tool({"echo", "health", "--seconds", "3", "--security", bus_.file("rogue")});
  EXPECT_TRUE(refused("unknown_authority"));
  EXPECT_EQ(echo->wait(10s), 0) << echo->log();
  EXPECT_THAT(echo->log(), Not(HasSubstr("semantic_filter")));
  expectUnheard();
}

TEST_F(Strangers, ThatMayOnlyReadDoSoButCannotWriteDetections) {
  const auto peer = writer(foreign(bus_, "subscriber"));
  const auto echo = bus_.tool({"echo", "health", "--seconds", "3", "--identity", "subscriber"});
  EXPECT_NE(peer->wait(10s), -1) << "its own DDS refuses";
  EXPECT_THAT(peer->log(), HasSubstr("may not make a writer of detections"));
  EXPECT_EQ(echo->wait(10s), 0) << echo->log();
  EXPECT_THAT(echo->log(), HasSubstr("semantic_filter"));
  expectUnheard();
}

/// A valid certificate with permissions made by the program itself, so that its own DDS allows it
/// to write.
TEST_F(LongStrangers, WhoWriteTheirOwnPermissionsAreRefusedByTheOthers) {
  const bus::Key key = tools::makeKey();
  const bus::Certificate own = tools::makeAuthority(key.get(), validFor(30));
  const tools::Signer signer{own.get(), key.get()};
  std::ofstream(bus_.file("own.pem")) << tools::toPem(own.get());
  std::ofstream(bus_.file("governance.p7s"))
      << tools::signedDocument(signer, tools::governanceXml());
  std::ofstream(bus_.file("permissions.p7s")) << tools::signedDocument(
      signer, tools::permissionsXml({"subscriber", "subscriber"}, "ego",
                                    tools::permissionsOf(bus::Role::kInference), validFor(30)));
  std::string xml = foreign(bus_, "subscriber");
  const auto replace = [&](const std::string& element, const std::string& file) {
    const std::string begin = "<" + element + ">file:";
    const auto at = xml.find(begin) + begin.size();
    xml.replace(at, xml.find('<', at) - at, bus_.file(file));
  };
  replace("PermissionsCA", "own.pem");
  replace("Governance", "governance.p7s");
  replace("Permissions", "permissions.p7s");
  const auto peer = writer(xml);
  EXPECT_TRUE(refused("permissions")) << peer->log();
  listen();
  EXPECT_EQ(peer->wait(0s), -1) << "it writes: " << peer->log();
  expectUnheard();
}

TEST_F(LongStrangers, WithAnExpiredCertificateDoNotComeToLife) {
  const auto now = std::chrono::system_clock::now();
  bus_.authority().add({.name = "old", .role = "inference"}, {now - 48h, now - 24h});
  const auto peer = writer(foreign(bus_, "old"));
  EXPECT_NE(peer->wait(10s), -1);
  EXPECT_THAT(peer->log(), HasSubstr("expired"));
  expectUnheard();
}

TEST(LongIdentity, ThatEndsEndsItsServiceWithTheFix) {
  ClosedBus bus;
  const auto now = std::chrono::system_clock::now();
  bus.authority().add({.name = "brief", .role = "map_store"}, {now - 1h, now + 5s});
  Watcher watcher(bus.options());
  const auto map_store = bus.mapStore({"bus.identity=brief"});
  EXPECT_TRUE(watcher.until([&] {
    const Health& health = watcher.health("map_store");
    return health.state == HealthState::kDegraded &&
           health.message.find("the identity brief ends in") != std::string::npos;
  })) << map_store->log();
  EXPECT_EQ(map_store->wait(15s), 1);
  EXPECT_THAT(map_store->log(), HasSubstr("perdure security renew"));
}

TEST(Identity, ThatIsNotFitStopsItsServiceAtTheStart) {
  ClosedBus bus;
  bus.authority().revoke("record");
  struct Case {
    std::vector<std::string> settings;
    int status;
    const char* words;
  };
  const Case cases[] = {
      {{"bus.identity=nobody"}, 69, "perdure security add"},
      {{"bus.identity=record"}, 69, "was revoked"},
      {{"bus.identity=vio"}, 78, "may not make"},
      {{"bus.vehicle=other"}, 78, "may not make"},
      {{"bus.shared_memory_mb=8"}, 78, "set one of them only"},
      {{"bus.security=" + bus.file("nothing")}, 69, "perdure security init"},
  };
  for (const Case& wrong : cases) {
    const auto map_store = bus.mapStore(wrong.settings);
    EXPECT_EQ(map_store->wait(10s), wrong.status) << wrong.settings[0] << map_store->log();
    EXPECT_THAT(map_store->log(), HasSubstr(wrong.words));
  }
}

TEST(LongIdentity, IsJudgedByDoctorAndStatusAndNoReportHoldsItsKey) {
  ClosedBus bus;
  std::ofstream(bus.file("capture.yaml")) << "source: dataset\n";
  bus.authority().add({.name = "soon", .role = "vio"}, validFor(3));
  auto doctor = bus.tool({"doctor", "--seconds", "1", "--config-dir", bus.file(""), "--report",
                          bus.file("report.tar.gz")});
  (void)doctor->wait(40s);
  EXPECT_THAT(doctor->log(), HasSubstr("WARN the identity soon ends in 2 days"));
  EXPECT_THAT(doctor->log(), HasSubstr("OK   the identity vio ends in 29 days"));
  const auto listing = std::make_unique<Child>(
      std::vector<std::string>{"tar", "-tzf", bus.file("report.tar.gz")}, bus.file("list"));
  EXPECT_EQ(listing->wait(10s), 0);
  EXPECT_THAT(listing->log(), HasSubstr("capture.yaml"));
  EXPECT_THAT(listing->log(), Not(HasSubstr(".pem")));
  bus.authority().revoke("soon");
  auto status = bus.tool({"status", "--seconds", "1"});
  EXPECT_EQ(status->wait(20s), 2);
  EXPECT_THAT(status->log(), HasSubstr("was revoked"));
}

}  // namespace
}  // namespace perdure::test
