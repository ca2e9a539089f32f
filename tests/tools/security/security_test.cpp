// Tests the authority's folder, its grants, and the reports about unusable identities.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

#include "common/base/errors.h"
#include "common/bus/security/identity.h"
#include "common/bus/security_log.h"
#include "tests/process/support.h"
#include "tools/security/authority.h"
#include "tools/security/private_file.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using bus::Role;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class Security : public testing::Test {
 protected:
  void SetUp() override { authority_.add({.name = "vio", .role = "vio"}, validFor(30)); }
  std::string dir() const { return folder_.file("security"); }
  std::string of(const std::string& name) const { return dir() + "/" + name; }
  std::string codeOf(const std::string& name) const {
    const auto identity = bus::readIdentity(of(name));
    return identity ? "fit" : identity.error().code;
  }
  std::string contents(const std::string& file) const {
    return test::contentsOf(dir() + "/" + file);
  }

  test::Folder folder_;
  Authority authority_ = Authority::create(dir(), "ego", 3650);
};

TEST_F(Security, MakesIdentitiesThatAreFitAndWhoseFilesAreForTheirOwnerAlone) {
  const auto identity = bus::readIdentity(of("vio"));
  ASSERT_TRUE(identity) << identity.error().detail;
  EXPECT_EQ(identity->name, "vio");
  EXPECT_EQ(identity->role, "vio");
  EXPECT_GT(identity->until - std::chrono::system_clock::now(), 29 * 24h);
  for (const auto& entry : fs::recursive_directory_iterator(dir())) {
    EXPECT_EQ(fs::status(entry).permissions() & (fs::perms::group_all | fs::perms::others_all),
              fs::perms::none)
        << entry.path();
  }
}

TEST_F(Security, SaysOfAnIdentityThatIsNotFitWhyAndTheFix) {
  struct Case {
    const char* code;
    std::function<void(const std::string& folder)> spoil;
  };
  const auto other = [&](const char* file, const std::string& folder) {
    fs::copy_file(of(std::string("other/") + file), folder + "/" + file,
                  fs::copy_options::overwrite_existing);
  };
  authority_.add({.name = "other", .role = "capture"}, validFor(30));
  Authority rogue = Authority::create(folder_.file("rogue"), "ego", 3650);
  const Case cases[] = {
      {"file_missing", [](const auto& f) { fs::remove(f + "/governance.p7s"); }},
      {"key_open", [](const auto& f) { chmod((f + "/key.pem").c_str(), 0644); }},
      {"key_wrong", [&](const auto& f) { other("key.pem", f); }},
      {"file_malformed", [](const auto& f) { std::ofstream(f + "/certificate.pem") << "no"; }},
      {"authority_wrong",
       [&](const auto& f) {
         for (const char* file : {"ca.pem", "revoked.pem"}) {
           fs::copy_file(folder_.file("rogue/authority/") + file, f + "/" + file,
                         fs::copy_options::overwrite_existing);
         }
       }},
  };
  for (const Case& spoiled : cases) {
    fs::remove_all(of("spoiled"));
    fs::copy(of("vio"), of("spoiled"));
    ASSERT_EQ(codeOf("spoiled"), "fit");
    spoiled.spoil(of("spoiled"));
    EXPECT_EQ(codeOf("spoiled"), spoiled.code);
    EXPECT_THAT(bus::readIdentity(of("spoiled")).error().detail, HasSubstr(of("spoiled")));
  }
}

TEST_F(Security, KnowsWhenAnIdentityBeginsAndEnds) {
  const auto now = std::chrono::system_clock::now();
  authority_.add({.name = "old", .role = "vio"}, {now - 48h, now - 24h});
  authority_.add({.name = "early", .role = "vio"}, {now + 24h, now + 48h});
  EXPECT_EQ(codeOf("old"), "expired");
  EXPECT_THAT(bus::readIdentity(of("old")).error().detail, HasSubstr("perdure security renew"));
  EXPECT_EQ(codeOf("early"), "not_yet_valid");
  authority_.renew("old", validFor(30));
  EXPECT_EQ(codeOf("old"), "fit");
}

TEST_F(Security, RevokesAllThatANameWasGiven) {
  const std::string first = contents("vio/certificate.pem"), key = contents("vio/key.pem");
  authority_.renew("vio", validFor(30));
  EXPECT_NE(contents("vio/certificate.pem"), first);
  authority_.add({.name = "other", .role = "capture"}, validFor(30));
  Authority again(dir());  // a new instance, as in the command
  again.revoke("vio");
  EXPECT_EQ(codeOf("vio"), "revoked");
  EXPECT_EQ(codeOf("other"), "fit");
  EXPECT_EQ(contents("other/revoked.pem"), contents("vio/revoked.pem"));
  writePrivate(of("vio/certificate.pem"), first, 0600);
  writePrivate(of("vio/key.pem"), key, 0600);
  EXPECT_EQ(codeOf("vio"), "revoked") << "the one before the renewal too";
  EXPECT_THROW(again.revoke("vio"), StartupError) << "nothing is left";
  again.renew("vio", validFor(30));
  EXPECT_EQ(codeOf("vio"), "fit") << "a new one takes its place";
}

TEST_F(Security, RefusesNamesRolesAndTopicsThatAreNone) {
  for (const char* name : {"", "../up", "a/b", "authority", ".hidden", "<x>", "vio"}) {
    EXPECT_THROW(authority_.add({.name = name, .role = "vio"}, validFor(1)), StartupError) << name;
  }
  EXPECT_THROW(authority_.add({.name = "x", .role = "king"}, validFor(1)), StartupError);
  EXPECT_THROW(authority_.add({"x", "subscriber", {"objcts"}}, validFor(1)), StartupError);
  EXPECT_THROW(authority_.add({"x", "vio", {}, "no such user"}, validFor(1)), StartupError);
  EXPECT_THROW(authority_.renew("x", validFor(1)), StartupError);
  EXPECT_THROW(Authority::create(dir(), "ego", 1), StartupError) << "there is one";
  EXPECT_THROW(Authority{folder_.file("nothing")}, StartupError);
  EXPECT_THAT(authority_.names(), ElementsAre("vio"));
}

TEST_F(Security, GivesASubscriberTheTopicsThatAreNamed) {
  authority_.add({"brief", "subscriber", {"objects", "frame/cam0"}}, validFor(30));
  authority_.renew("brief", validFor(30));
  const std::string document = contents("brief/permissions.p7s");
  EXPECT_THAT(document, HasSubstr("<subject_name>CN=brief,OU=subscriber,O=perdure<"));
  EXPECT_THAT(document, HasSubstr("<subscribe><topics><topic>perdure/ego/objects</topic>"
                                  "<topic>perdure/ego/frame/cam0</topic></topics></subscribe>"));
  EXPECT_THAT(document, HasSubstr("<publish><topics><topic>perdure/ego/map/query</topic>"
                                  "</topics></publish>"));
}

TEST_F(Security, GivesADriverOfRosTheTopicsThatItStandsFor) {
  authority_.add({"eye", "ros2_driver", {"frame/cam0", "calibration"}}, validFor(30));
  EXPECT_THAT(contents("eye/permissions.p7s"),
              HasSubstr("<publish><topics><topic>perdure/ego/frame/cam0</topic>"
                        "<topic>perdure/ego/calibration</topic><topic>perdure/ego/health</topic>"
                        "</topics></publish>"));
  EXPECT_THROW(authority_.add({"ear", "ros2_driver", {"objects"}}, validFor(30)), StartupError);
}

TEST(Permissions, AreTheLeastThatEachRoleNeeds) {
  EXPECT_THAT(permissionsOf(Role::kSubscriber).writes, ElementsAre("map/query"));
  EXPECT_THAT(permissionsOf(Role::kSubscriber).reads, Not(Contains("frame/*")));
  EXPECT_THAT(permissionsOf(Role::kSubscriber).reads, Contains("objects"));
  EXPECT_THAT(permissionsOf(Role::kCapture).writes,
              ElementsAre("frame/*", "imu", "speed", "calibration", "health"));
  EXPECT_THAT(permissionsOf(Role::kOperator).writes, ElementsAre("map/query", "map/correct"));
  EXPECT_THAT(permissionsOf(Role::kRecord).writes, ElementsAre("health"));
  EXPECT_THAT(permissionsOf(Role::kGateway).writes,
              ElementsAre("map/query", "map/correct", "health"));
  EXPECT_THAT(permissionsOf(Role::kGateway).reads, Contains("frame/*"));
  EXPECT_THAT(permissionsOf(Role::kRos2).writes, ElementsAre("health"));
  EXPECT_THAT(permissionsOf(Role::kRos2).reads, Contains("frame/*"));
  EXPECT_THAT(
      permissionsOf(Role::kRos2Driver).writes,
      ElementsAre("frame/*", "imu", "calibration", "odometry", "detections", "model", "health"));
  EXPECT_THAT(permissionsOf(Role::kPlayer).reads, IsEmpty());
}

TEST(Permissions, GiveEachTopicOneServiceThatWritesItAndEventsTwo) {
  constexpr Role kServices[] = {Role::kCapture, Role::kVio, Role::kInference, Role::kSemanticFilter,
                                Role::kMapStore};
  for (const bus::TopicInfo& info : bus::topicTable()) {
    const auto writers = std::count_if(std::begin(kServices), std::end(kServices),
                                       [&](Role role) { return info.writers.has(role); });
    if (info.name == "map/correct") {
      EXPECT_EQ(writers, 0) << "people write it";
      continue;
    }
    // The filter and the map's graph write events.
    EXPECT_EQ(writers, info.name == "health" ? 5 : info.name == "events" ? 2 : 1) << info.name;
    EXPECT_TRUE(info.readers.has(Role::kRecord) && info.readers.has(Role::kOperator));
  }
}

TEST(Permissions, CannotBeWidenedByANameOfAVehicle) {
  const std::string xml =
      permissionsXml({"a", "vio"}, "x</topic><topic>*", {{"imu"}, {}}, validFor(1));
  EXPECT_THAT(xml, Not(HasSubstr("<topic>*")));
}

TEST(Identities, BelongToProcesses) {
  EXPECT_EQ(bus::identityOf("vio"), "vio");
  EXPECT_EQ(bus::identityOf("perdure doctor"), "operator");
  EXPECT_EQ(bus::identityOf("perdure play"), "player");
  EXPECT_EQ(bus::identityOf("black_box"), "record");
}

TEST(SecurityLog, CountsEachStrangerOnceAndEachRefusedHandshake) {
  bus::SecurityLog log;
  const std::string plain =
      "Non secure remote writer 110dd36:a6389e53:687a9606:3c2 is not allowed.";
  EXPECT_TRUE(log.take(plain));
  EXPECT_TRUE(log.take("Non secure remote reader 110dd36:a6389e53:687a9606:3c7 is not allowed."));
  EXPECT_TRUE(log.take("Non secure remote writer 2:3:4:3c2 is not allowed."));
  const std::string expired =
      "Begin handshake reply failed: Certificate not valid: error: certificate has expired; "
      "subject: /O=x(code: 200)";
  EXPECT_TRUE(log.take(expired) && log.take(expired));
  EXPECT_FALSE(log.take("sendmsg failed: Network is unreachable"));
  ReasonCounts counts;
  log.report(counts);
  EXPECT_EQ(counts.of("security_refused_no_certificate"), 2u);
  EXPECT_EQ(counts.of("security_refused_expired"), 2u);
  EXPECT_EQ(counts.all().size(), 2u);
  EXPECT_EQ(log.firstDetails().at("security_refused_no_certificate"), plain);
}

}  // namespace
}  // namespace perdure::tools
