// Tests perdure-map-store as a process: killed and restarted, queried over DDS and through its
// file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <map>
#include <optional>
#include <utility>

#include "common/bus/map_client.h"
#include "common/bus/topics.h"
#include "common/bus/wait_loop.h"
#include "tests/process/support.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/support/corrections.h"

namespace perdure::test {
namespace {

using namespace std::chrono_literals;
using map_store::test::carAt;
using map_store::test::workingSet;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class MapStoreProcess : public ::testing::Test {
 protected:
  std::unique_ptr<Child> start() {
    const std::string log = folder_.file("log-" + std::to_string(++starts_));
    auto child = std::make_unique<Child>(
        std::vector<std::string>{(programs() / "perdure-map-store").string(), "--set",
                                 "store.path=" + folder_.file("map.sqlite")},
        log);
    EXPECT_TRUE(eventually(10s, [&] { return objects_.matched() > 0; })) << child->log();
    return child;
  }

  /// Makes beliefs that are valid on the wire: symmetric covariances, PMFs that sum to one.
  static Objects frame(std::uint64_t sequence, ObjectId objects) {
    std::vector<ObjectBelief> cars;
    for (ObjectId id = 1; id <= objects; ++id) {
      cars.push_back(carAt(id, {static_cast<double>(id), 0.5, 0}));
    }
    return workingSet(sequence, cars);
  }

  std::size_t objectsOnTheMap() {
    const auto reply = bus::MapClient(participant_).ask({}, 10.0);
    return reply ? reply->objects.size() : SIZE_MAX;
  }

  bus::Domain domain_{ownNetwork()};
  bus::Participant participant_{domain_, "test"};
  bus::Writer<Objects> objects_{participant_, bus::kTopic<Objects>};
  Folder folder_;
  int starts_ = 0;
};

TEST_F(MapStoreProcess, HasEveryObjectAgainAfterItIsKilledASecondAfterItsConfirmation) {
  const auto first = start();
  ASSERT_TRUE(objects_.write(frame(1, 5)).has_value());
  ASSERT_TRUE(eventually(1s, [&] { return objectsOnTheMap() == 5; })) << first->log();
  first->signal(SIGKILL);
  ASSERT_EQ(first->wait(5s), 128 + SIGKILL);
  ASSERT_TRUE(eventually(15s, [&] { return objects_.matched() == 0; }));
  const auto second = start();
  EXPECT_EQ(objectsOnTheMap(), 5u) << second->log();
}

TEST_F(MapStoreProcess, GivesTheWorkingSetBackToAFilterThatAsks) {
  const auto child = start();
  bus::Reader<MapNear> near(participant_, bus::kTopic<MapNear>);
  bus::Writer<MapQuery> queries(participant_, bus::kTopic<MapQuery>);
  ASSERT_TRUE(eventually(5s, [&] { return near.matched() > 0 && queries.matched() > 0; }));
  ASSERT_TRUE(objects_.write(frame(1, 3)).has_value());
  ASSERT_TRUE(eventually(5s, [&] { return objectsOnTheMap() == 3; }));
  MapQuery restore;
  restore.client = 99;
  restore.request = 1;
  restore.kind = MapQueryKind::kRestore;
  ASSERT_TRUE(queries.write(restore).has_value());
  std::optional<MapNear> answer;
  ASSERT_TRUE(eventually(5s, [&] {
    near.drain([&](const MapNear& m) {
      if (m.client == restore.client) answer = m;
    });
    return answer.has_value();
  })) << child->log();
  EXPECT_EQ(answer->world, frame(1, 3).world);
  EXPECT_EQ(answer->next_id, 4u);
  EXPECT_TRUE(answer->as_published.empty());
  ASSERT_EQ(answer->placed.size(), 3u);
  EXPECT_EQ(answer->placed[2].best().mean, frame(1, 3).objects[2].best().mean);
  EXPECT_EQ(answer->placed[2].why, frame(1, 3).objects[2].why);
}

TEST_F(MapStoreProcess, ACorrectionStandsAfterItIsKilledUntilItIsWithdrawn) {
  bus::MapClient map(participant_);
  MapQuery one;
  one.kind = MapQueryKind::kById;
  one.object_id = 2;
  const auto existence = [&] {
    const auto reply = map.ask(one, 10.0);
    return reply && !reply->objects.empty() ? reply->objects[0].existence : -1.0;
  };
  const auto first = start();
  ASSERT_TRUE(objects_.write(frame(1, 3)).has_value());
  ASSERT_TRUE(eventually(5s, [&] { return objectsOnTheMap() == 3; }));
  const double before = existence();
  const auto made = map.correct(notThere(2), 10.0);
  ASSERT_TRUE(made && made->ok) << first->log();
  first->signal(SIGKILL);
  ASSERT_EQ(first->wait(5s), 128 + SIGKILL);
  ASSERT_TRUE(eventually(15s, [&] { return objects_.matched() == 0; }));
  const auto second = start();
  EXPECT_LT(existence(), 0.01) << second->log();
  const auto withdrawn = map.correct(withdrawal(made->corrections.at(0).id), 10.0);
  ASSERT_TRUE(withdrawn && withdrawn->ok) << second->log();
  EXPECT_EQ(existence(), before);
}

TEST_F(MapStoreProcess, GivesBackWhatLeftTheWorkingSetAndSaysThatItHasIt) {
  const auto child = start();
  bus::Reader<MapNear> near(participant_, bus::kTopic<MapNear>);
  ASSERT_TRUE(eventually(5s, [&] { return near.matched() > 0; }));
  const Objects whole = frame(1, 3);
  Objects left = frame(2, 1);
  left.near_m = 100.0;
  ASSERT_TRUE(objects_.write(whole).has_value());
  ASSERT_TRUE(objects_.write(left).has_value());
  MapNear newest;
  std::uint64_t revision = 0;
  ASSERT_TRUE(eventually(5s, [&] {
    near.drain([&](const MapNear& m) {
      EXPECT_GT(m.revision, std::exchange(revision, m.revision));
      newest = m;
    });
    return newest.kept == left.stamp.time;
  })) << child->log();
  EXPECT_EQ(newest.client, left.instance);
  EXPECT_EQ(newest.world, left.world);
  EXPECT_TRUE(newest.placed.empty());
  ASSERT_EQ(newest.as_published.size(), 2u);
  const ObjectBelief &given = newest.as_published[1], &published = whole.objects[2];
  EXPECT_EQ(given.trackId(), published.id);
  EXPECT_EQ(given.best().mean, published.best().mean);
  EXPECT_EQ(given.best().cross_pose, published.best().cross_pose);
}

TEST_F(MapStoreProcess, AnswersWithItsGraph) {
  const auto child = start();
  bus::Writer<Odometry> odometry(participant_, bus::kTopic<Odometry>);
  ASSERT_TRUE(eventually(5s, [&] { return odometry.matched() > 0; }));
  const Objects first = frame(1, 3);
  for (std::uint64_t i = 1; i <= 40; ++i) {
    Odometry pose;
    pose.stamp = frame(i, 0).stamp;
    pose.world = first.world;
    pose.state = OdometryState::kTracking;
    pose.T_WB.p.x() = static_cast<double>(i);
    ASSERT_TRUE(odometry.write(pose).has_value());
  }
  MapQuery query;
  query.kind = MapQueryKind::kGraph;
  Result<MapReply> reply = fail("not_asked");
  ASSERT_TRUE(eventually(10s, [&] {
    reply = bus::MapClient(participant_).ask(query, 5.0);
    return reply && reply->anchors.size() >= 4;
  })) << child->log();
  EXPECT_TRUE(reply->ok);
  EXPECT_EQ(reply->anchors[0].map, first.world);
  EXPECT_EQ(reply->anchors[1].previous, reply->anchors[0].id);
  EXPECT_GT(reply->anchors[3].p.x(), reply->anchors[2].p.x());
  EXPECT_EQ(reply->anchor_count, reply->anchors.size());
}

TEST_F(MapStoreProcess, SaysWhyOverDdsAndFromItsFileAlike) {
  const auto child = start();
  ASSERT_TRUE(objects_.write(frame(1, 3)).has_value());
  ASSERT_TRUE(eventually(5s, [&] { return objectsOnTheMap() == 3; }));
  const std::string perdure = (programs() / "perdure").string();
  const auto why = [&](const char* id, std::vector<std::string> source) {
    source.insert(source.begin(), {perdure, "map", "why", id});
    Child command(source, folder_.file("why"));
    const int code = command.wait(20s);
    return std::make_pair(code, command.log());
  };
  const std::vector<std::string> file = {"--db", folder_.file("map.sqlite")};
  const auto asked = why("3", {});
  EXPECT_EQ(asked.first, 0) << asked.second;
  EXPECT_THAT(asked.second, HasSubstr("Object 3 exists with probability 0.970"));
  EXPECT_THAT(asked.second, HasSubstr("detected in 7 observations"));
  const auto read = why("3", file);
  EXPECT_EQ(read.first, 0) << read.second;
  EXPECT_THAT(read.second, StartsWith(asked.second)) << "the same, and what the graph knows";
  EXPECT_THAT(read.second, HasSubstr("it belongs to no anchor"));
  const auto unknown = why("17", file);
  EXPECT_NE(unknown.first, 0);
  EXPECT_THAT(unknown.second, HasSubstr("no object 17"));
}

TEST_F(MapStoreProcess, ShowsItsTilesToALateJoiner) {
  const auto child = start();
  ASSERT_TRUE(objects_.write(frame(1, 40)).has_value());
  ASSERT_TRUE(eventually(5s, [&] { return objectsOnTheMap() == 40; }));
  bus::Reader<MapTile> tiles(participant_, bus::kTopic<MapTile>);
  bus::Reader<MapHeader> headers(participant_, bus::kTopic<MapHeader>);
  std::map<std::pair<int, int>, std::size_t> counts;
  MapHeader header;
  EXPECT_TRUE(eventually(5s, [&] {
    tiles.drain([&](const MapTile& t) { counts[{t.x, t.y}] = t.objects.size(); });
    headers.drain([&](const MapHeader& h) { header = h; });
    std::size_t sum = 0;
    for (const auto& [square, count] : counts) sum += count;
    return header.objects == 40 && sum == 40;
  })) << child->log();
  EXPECT_EQ(header.tiles, counts.size());
}

TEST_F(MapStoreProcess, EndsWithinASecondAndLeavesAFileThatTheCommandReads) {
  const auto child = start();
  ASSERT_TRUE(objects_.write(frame(1, 4)).has_value());
  ASSERT_TRUE(eventually(5s, [&] { return objectsOnTheMap() == 4; }));
  child->signal(SIGTERM);
  EXPECT_EQ(child->wait(1s), 0) << child->log();
  Child command(
      {(programs() / "perdure").string(), "map", "list", "--db", folder_.file("map.sqlite")},
      folder_.file("list"));
  EXPECT_EQ(command.wait(10s), 0) << command.log();
  EXPECT_THAT(command.log(), HasSubstr("car"));
}

TEST_F(MapStoreProcess, SaysWhatToDoWhenNobodyAnswersOrTheFileIsMissing) {
  const std::string perdure = (programs() / "perdure").string();
  Child asking({perdure, "map", "list", "--wait", "1"}, folder_.file("asking"));
  EXPECT_EQ(asking.wait(10s), 69);
  EXPECT_THAT(asking.log(), HasSubstr("start perdure-map-store"));
  Child reading({perdure, "map", "list", "--db", folder_.file("none")}, folder_.file("reading"));
  EXPECT_EQ(reading.wait(10s), 69);
  EXPECT_THAT(reading.log(), HasSubstr("store.path"));
  Child vague({perdure, "map", "query"}, folder_.file("vague"));
  EXPECT_EQ(vague.wait(10s), 64);
}

}  // namespace
}  // namespace perdure::test
