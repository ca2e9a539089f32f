// Failures of a server: the message has the fix, waits are bounded, and the failure ends when it is
// fixed. No message has a password.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <thread>

#include "common/base/errors.h"
#include "services/map_store/fleet/map_transfer.h"
#include "services/map_store/fleet/server_schema.h"
#include "services/map_store/fleet/server_url.h"
#include "tests/services/map_store/fleet/files.h"
#include "tests/services/map_store/fleet/postgres_server.h"
#include "tests/services/map_store/fleet/wire.h"

namespace perdure::map_store {
namespace {

using test::configOf;
using test::kLong;
using test::PostgresServer;
using test::quick;
using test::TemporaryFolder;
using test::Vehicle;
using ::testing::HasSubstr;
using ::testing::Not;

std::string refusalOf(const fleet::Parameters& parameters) {
  try {
    fleet::check(parameters);
  } catch (const StartupError& error) {
    EXPECT_EQ(error.code(), ExitCode::kConfiguration);
    return error.what();
  }
  return {};
}

TEST(FleetUrl, WhatIsNoUrlOfPostgresqlIsRefusedWithoutRepeatingIt) {
  for (const char* url : {"mysql://boss:s3cret@host/db", "host=there password=s3cret",
                          "postgresql://boss@host:s3cret/db", "postgresql://[::1/s3cret"}) {
    const std::string refusal = refusalOf({url, "", {}});
    EXPECT_THAT(refusal, HasSubstr("give postgresql://USER@HOST:PORT/DATABASE")) << url;
    EXPECT_THAT(refusal, Not(HasSubstr("s3cret")));
  }
}

TEST(FleetUrl, APasswordInItIsRefused) {
  for (const char* url :
       {"postgresql://boss:s3cret@host/db", "postgresql://host/db?password=s3cret",
        "postgres://host/db?sslpassword=s3cret"}) {
    const std::string refusal = refusalOf({url, "", {}});
    EXPECT_THAT(refusal, HasSubstr("passfile=FILE")) << url;
    EXPECT_THAT(refusal, Not(HasSubstr("s3cret")));
  }
  EXPECT_EQ(refusalOf({"postgresql://boss@host:5433/db?passfile=/etc/perdure/pass", "", {}}), "");
  EXPECT_EQ(refusalOf({"", "", {}}), "");
}

TEST(FleetUrl, APlaceThatIsNotOnEarthIsRefused) {
  using Place = std::vector<double>;
  for (const Place& place :
       {Place{49.0, 8.0, 100.0}, Place{91.0, 8.0, 100.0, 0.0}, Place{49.0, NAN, 100.0, 0.0}}) {
    EXPECT_THAT(refusalOf({"", "", place}), HasSubstr("give latitude, longitude, height, yaw"));
  }
  EXPECT_EQ(refusalOf({"", "", {49.0, 8.4, 110.0, 90.0}}), "");
}

TEST(FleetUrl, ANameThatCannotBeAFilesIsRefused) {
  for (const char* name : {"../red", ".red", "red\n", "a/b"}) {
    EXPECT_THAT(refusalOf({"", name, {}}), HasSubstr("store.vehicle")) << name;
  }
  EXPECT_EQ(refusalOf({"", "Wagen Süd-3", {}}), "");
}

/// The reason why a vehicle's map is not sent to `url`, and the message about it.
struct Trouble {
  ReasonCounts reasons;
  std::string sentence;
};
Trouble troubleWith(const std::string& url, fleet::Pace pace = quick()) {
  const TemporaryFolder folder;
  Vehicle vehicle(configOf(folder.file("map.sqlite"), url), pace);
  for (std::uint64_t n = 1; n <= 3; ++n) vehicle.step(n);
  fleet::Progress progress;
  for (int tries = 0; progress.trouble.empty() && tries < 6000; ++tries) {
    usleep(10'000);
    progress = vehicle.fleet().progress();
  }
  EXPECT_EQ(vehicle.node().commits(), 3u);
  EXPECT_FALSE(progress.whole);
  return {progress.reasons, progress.trouble};
}

TEST(FleetTrouble, NobodyListens) {
  if (!fleet::isBuilt()) GTEST_SKIP();
  const auto trouble = troubleWith("postgresql://boss@127.0.0.1:1/fleet");
  EXPECT_GE(trouble.reasons.of("server_unreachable"), 1u);
  EXPECT_THAT(trouble.sentence, HasSubstr("see that the server runs"));
}

TEST(FleetTrouble, AServerThatAcceptsAndSaysNothingIsGivenUp) {
  const test::SilentPort silent;
  auto pace = quick();
  pace.connect = std::chrono::milliseconds(100);
  const auto trouble =
      troubleWith("postgresql://boss@127.0.0.1:" + std::to_string(silent.port()) + "/fleet", pace);
  EXPECT_GE(trouble.reasons.of("server_unreachable"), 1u);
  EXPECT_THAT(trouble.sentence, HasSubstr("does not answer"));
}

TEST(FleetTrouble, AWaitForASilentServerEndsWithTheService) {
  const test::SilentPort silent;
  const TemporaryFolder folder;
  auto pace = quick();
  pace.connect = std::chrono::hours(1);
  Vehicle vehicle(configOf(folder.file("map.sqlite"), "postgresql://boss@127.0.0.1:" +
                                                          std::to_string(silent.port()) + "/fleet"),
                  pace);
  vehicle.step(1);  // the destructor must not wait for an hour
}

TEST(FleetTrouble, AWrongPasswordIsSaidAndNotRepeated) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  std::string url = server->makeDatabase();
  url = url.substr(0, url.find('?')) + "?passfile=" + server->passfile("wrong-4711");
  const auto trouble = troubleWith(url);
  EXPECT_GE(trouble.reasons.of("server_login"), 1u);
  EXPECT_THAT(trouble.sentence, HasSubstr("passfile"));
  EXPECT_THAT(trouble.sentence, Not(HasSubstr("4711")));
}

TEST(FleetTrouble, NoPasswordAndNoDatabase) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const std::string url = server->makeDatabase();
  const auto no_password = troubleWith(url.substr(0, url.find('?')) + "?passfile=/dev/null");
  EXPECT_GE(no_password.reasons.of("server_login"), 1u) << no_password.sentence;
  EXPECT_GE(troubleWith(server->url("nowhere")).reasons.of("server_login"), 1u);
}

TEST(FleetTrouble, AUserWithoutRights) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  std::string url = server->makeDatabase();
  server->run(url, "CREATE ROLE guest LOGIN PASSWORD 'guest-0815'");
  const std::string guest = "postgresql://guest" +
                            url.substr(url.find('@'), url.find('?') - url.find('@')) +
                            "?passfile=" + server->passfile("guest-0815");
  const auto trouble = troubleWith(guest);
  EXPECT_GE(trouble.reasons.of("server_rights"), 1u) << trouble.sentence;
  EXPECT_THAT(trouble.sentence, HasSubstr("GRANT"));
}

TEST(FleetTrouble, AnotherVersionsSchemaIsLeftAlone) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  for (const std::int64_t other : {fleet::kServerSchema - 1, fleet::kServerSchema + 1}) {
    const std::string version = std::to_string(other);
    const std::string url = server->makeDatabase();
    server->run(url,
                "CREATE SCHEMA perdure; CREATE TABLE perdure.about(version bigint NOT NULL); "
                "INSERT INTO perdure.about VALUES(" +
                    version + ")");
    const auto trouble = troubleWith(url);
    EXPECT_GE(trouble.reasons.of("server_schema"), 1u);
    EXPECT_THAT(trouble.sentence, HasSubstr("schema " + version + ", this program knows " +
                                            std::to_string(fleet::kServerSchema)));
    EXPECT_THAT(trouble.sentence, HasSubstr("use the same version of Perdure"));
    const TemporaryFolder folder;
    EXPECT_THROW(fleet::pullMap(url, "red", folder.file("x.sqlite")), StartupError);
    EXPECT_FALSE(std::filesystem::exists(folder.file("x.sqlite")));
    EXPECT_EQ(server->number(url, "SELECT count(*) FROM pg_class WHERE relname = 'maps'"), 0);
  }
}

/// The server refuses rows of objects with this SQLSTATE until this is reverted.
void refuseObjects(PostgresServer& server, const std::string& url, const std::string& state) {
  server.run(
      url,
      "CREATE FUNCTION refuse() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN RAISE EXCEPTION "
      "'not now' USING ERRCODE = '" +
          state +
          "'; END $$; CREATE TRIGGER refuse BEFORE INSERT OR UPDATE ON perdure.objects FOR "
          "EACH ROW EXECUTE FUNCTION refuse()");
}

TEST(FleetTrouble, AFullDiskAndARefusalAreSaidAndOverOnceRepaired) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  struct Case {
    const char *state, *code, *fix;
  };
  for (const Case& each : {Case{"53100", "server_full", "free space on the server"},
                           Case{"23514", "server_refused", "see the server's log"}}) {
    const TemporaryFolder folder;
    const std::string url = server->makeDatabase();
    Vehicle vehicle(configOf(folder.file("map.sqlite"), url), quick());
    vehicle.step(1);
    ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
    refuseObjects(*server, url, each.state);
    vehicle.step(2);
    ASSERT_TRUE(test::eventually([&] { return vehicle.fleet().progress().failing == each.code; }))
        << vehicle.fleet().progress().trouble;
    EXPECT_THAT(vehicle.fleet().progress().trouble, HasSubstr(each.fix));
    for (std::uint64_t n = 3; n <= 6; ++n) vehicle.step(n);
    EXPECT_EQ(vehicle.node().commits(), 6u);
    EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects"), 1);
    server->run(url, "DROP TRIGGER refuse ON perdure.objects");
    ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
    EXPECT_EQ(vehicle.fleet().progress().trouble, "");
    EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects"), 6);
  }
}

TEST(FleetTrouble, AServerThatHangsIsLeftAndItsLateCommitDoublesNothing) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase();
  test::Relay relay(server->port());
  auto pace = quick();
  pace.answer = pace.connect = std::chrono::seconds(2);
  Vehicle vehicle(configOf(folder.file("map.sqlite"), PostgresServer::through(relay.port(), url)),
                  pace);
  vehicle.step(1);
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  relay.hang(true);
  vehicle.step(2);
  ASSERT_TRUE(test::eventually([&] { return !vehicle.fleet().progress().failing.empty(); }));
  EXPECT_THAT(vehicle.fleet().progress().trouble, HasSubstr("the server does not answer"));
  for (std::uint64_t n = 3; n <= 9; ++n) vehicle.step(n);
  EXPECT_EQ(vehicle.node().commits(), 9u);
  relay.hang(false);
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects"), 9);
}

TEST(FleetTrouble, AWaitForAServerThatHangsEndsWithTheService) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  test::Relay relay(server->port());
  auto pace = quick();
  pace.answer = std::chrono::hours(1);
  Vehicle vehicle(configOf(folder.file("map.sqlite"),
                           PostgresServer::through(relay.port(), server->makeDatabase())),
                  pace);
  vehicle.step(1);
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  relay.hang(true);
  vehicle.step(2);
  EXPECT_FALSE(vehicle.fleet().finish(std::chrono::milliseconds(50)));
}  // the destructor must not wait for an hour

TEST(FleetTrouble, WithoutPostgisTheRowsAreThereAndItIsCounted) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const std::string url = server->makeDatabase();
  // A user without the right to create extensions, like a vehicle's user.
  server->run(url, "CREATE ROLE plain LOGIN PASSWORD 'plain-1'; GRANT CREATE ON DATABASE " +
                       url.substr(url.find('/', 13) + 1, url.find('?') - url.find('/', 13) - 1) +
                       " TO plain");
  const std::string plain = "postgresql://plain" +
                            url.substr(url.find('@'), url.find('?') - url.find('@')) +
                            "?passfile=" + server->passfile("plain-1");
  const TemporaryFolder folder;
  Vehicle vehicle(configOf(folder.file("map.sqlite"), plain), quick());
  for (std::uint64_t n = 1; n <= 3; ++n) vehicle.step(n);
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  EXPECT_EQ(vehicle.fleet().progress().reasons.of("postgis_missing"), 1u);
  EXPECT_THAT(vehicle.fleet().progress().notice, HasSubstr("postgresql-15-postgis-3"));
  EXPECT_EQ(vehicle.fleet().progress().trouble, "");
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects_in_map"), 3);
}

TEST(FleetTrouble, ASlowServerGetsEverythingAndHoldsNobodyUp) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase();
  test::Relay relay(server->port());
  relay.slowTo(20'000);
  auto pace = quick();
  pace.most_rows = 20;
  Vehicle vehicle(configOf(folder.file("map.sqlite"), PostgresServer::through(relay.port(), url)),
                  pace);
  for (std::uint64_t n = 1; n < 40; ++n) vehicle.step(n);
  relay.slowTo(3'000'000);
  vehicle.step(40);
  EXPECT_EQ(vehicle.node().commits(), 40u);
  EXPECT_FALSE(vehicle.fleet().progress().whole);  // the commit did not wait for the server
  relay.slowTo(20'000);
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects"), 40);
}

TEST(FleetTrouble, AConnectionThatIsCutIsMadeAgain) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase();
  test::Relay relay(server->port());
  Vehicle vehicle(configOf(folder.file("map.sqlite"), PostgresServer::through(relay.port(), url)),
                  quick());
  for (std::uint64_t n = 1; n <= 6; ++n) {
    vehicle.step(n);
    ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
    relay.cut();
    usleep(20'000);
  }
  EXPECT_GE(vehicle.fleet().progress().reasons.of("server_unreachable"), 1u);
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects"), 6);
}

TEST(FleetTrouble, ANameThatIsNotTextStopsNobody) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(), file = folder.file("map.sqlite");
  MapDatabase database({.path = file, .outbox = true});
  fleet::Replicator replicator({url, "red", {}}, file, quick());
  const Objects objects = test::workingSet(1, {test::carAt(1, {1, 2, 3}, "caf\xc3\xa9"),
                                               test::carAt(2, {1, 2, 3}, "bad\xff\xed\xa0\x80")});
  ASSERT_TRUE(database.write({&objects, {}, {}}).has_value());
  replicator.wake();
  ASSERT_TRUE(replicator.finish(kLong)) << replicator.progress().trouble;
  EXPECT_EQ(server->number(url,
                           "SELECT count(*) FROM perdure.objects WHERE class IN "
                           "('caf\xc3\xa9', 'bad' || repeat('?', 4))"),
            2);
}

TEST(FleetTrouble, SeveralMakeTheSchemaAtOnce) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const std::string url = server->makeDatabase(true);
  std::array<bool, 4> made{};
  {
    std::vector<std::jthread> threads;
    for (bool& done : made) {
      threads.emplace_back([&] {
        const fleet::Stop stop;
        auto link = fleet::Link::open(url, {}, stop);
        done = link && fleet::prepareServer(*link).has_value();
      });
    }
  }
  EXPECT_THAT(made, ::testing::Each(true));
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.about"), 1);
}

}  // namespace
}  // namespace perdure::map_store
