// A process that writes the map is killed at any moment: everything that it reported as written is
// on disk.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "services/map_store/node.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/services/map_store/graphs.h"

namespace perdure::map_store {
namespace {

using namespace std::chrono_literals;
using test::carAt;

/// Confirms one more object per frame and reports through `pipe` which id is durable.
[[noreturn]] void writeUntilKilled(const std::string& path, int pipe) {
  Config config;
  config.store_path = path;
  Node node(config, 5,
            {[](const MapTile&) {}, [](const MapTile&) {}, [](const MapHeader&) {},
             [](const MapReply&) {}, [](const MapNear&) {}});
  std::vector<ObjectBelief> cars;
  for (ObjectId id = 1;; ++id) {
    cars.push_back(carAt(id, {1.0 * static_cast<double>(id), 0, 0}));
    if (cars.size() > 20) cars.erase(cars.begin());
    node.onObjects(test::workingSet(id, cars));
    const auto commits = node.commits();
    node.tick(id * 200ms);
    if (node.commits() == commits) continue;
    if (write(pipe, &id, sizeof id) != static_cast<ssize_t>(sizeof id)) _exit(1);
  }
}

TEST(MapStoreDurability, LosesNothingThatWasCommittedWhenItIsKilled) {
  const test::TemporaryFolder folder;
  for (int round = 0; round < 5; ++round) {
    const std::string path = folder.file("map-" + std::to_string(round) + ".sqlite");
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) writeUntilKilled(path, ends[1]);
    close(ends[1]);
    ObjectId durable = 0;
    while (durable < static_cast<ObjectId>(30 + 7 * round) &&
           read(ends[0], &durable, sizeof durable) == static_cast<ssize_t>(sizeof durable)) {
    }
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    close(ends[0]);
    ASSERT_TRUE(WIFSIGNALED(status));
    ASSERT_GE(durable, 30u);

    const MapDatabase after({path});
    EXPECT_TRUE(after.notice().empty()) << after.notice();
    const auto found = after.reader().find({}, {}, 100000);
    ASSERT_TRUE(found.has_value());
    ASSERT_GE(found->objects.size(), durable);
    for (ObjectId id = 1; id <= durable; ++id) EXPECT_EQ(found->objects[id - 1].id, id);
    EXPECT_GE(after.reader().working().value()->next_id, durable + 1);
  }
}

/// Moves all anchors in each commit, to x = y = the number of the commit.
[[noreturn]] void moveUntilKilled(const std::string& path, int pipe) {
  MapDatabase database({path});
  mapping::Unsaved graph{test::RandomGraph(3).map({400, 500, 100, 1}), {}, {}};
  for (std::uint64_t n = 1;; ++n) {
    for (auto& [id, saved] : graph.changed.anchors) {
      saved.T_MA.p.x() = saved.T_MA.p.y() = static_cast<double>(n);
    }
    for (auto& [id, saved] : graph.changed.edges) saved.weight = 1.0 / static_cast<double>(n);
    const Objects objects = test::workingSet(n, {carAt(n, {1, 2, 3})});
    Batch batch{&objects, {}, {}};
    batch.graph = batch.facts = &graph;
    if (!database.write(batch)) _exit(1);
    if (write(pipe, &n, sizeof n) != static_cast<ssize_t>(sizeof n)) _exit(1);
  }
}

TEST(MapStoreDurability, KeepsAllOfAGraphOfOneCommitWhenItIsKilled) {
  const test::TemporaryFolder folder;
  for (int round = 0; round < 5; ++round) {
    const std::string path = folder.file("map-" + std::to_string(round) + ".sqlite");
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) moveUntilKilled(path, ends[1]);
    close(ends[1]);
    std::uint64_t durable = 0;
    while (durable < static_cast<std::uint64_t>(4 + round) &&
           read(ends[0], &durable, sizeof durable) == static_cast<ssize_t>(sizeof durable)) {
    }
    usleep(static_cast<useconds_t>(1500 * round));
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    while (read(ends[0], &durable, sizeof durable) == static_cast<ssize_t>(sizeof durable)) {
    }
    close(ends[0]);
    ASSERT_TRUE(WIFSIGNALED(status));
    ASSERT_GE(durable, 4u);

    const MapDatabase after({path});
    EXPECT_TRUE(after.notice().empty()) << after.notice();
    const auto graph = after.reader().graph();
    ASSERT_TRUE(graph.has_value());
    EXPECT_EQ(graph->malformed, 0u);
    ASSERT_EQ(graph->map.anchors.size(), 400u);
    ASSERT_EQ(graph->map.edges.size(), 500u);
    EXPECT_EQ(graph->map.facts.size(), 5u);
    EXPECT_EQ(graph->map.tracks.size(), 10u);
    const double n = graph->map.anchors.begin()->second.T_MA.p.x();
    EXPECT_GE(n, static_cast<double>(durable));
    EXPECT_LE(n, static_cast<double>(durable + 1));
    for (const auto& [id, saved] : graph->map.anchors) {
      EXPECT_EQ(saved.T_MA.p.x(), n);
      EXPECT_EQ(saved.T_MA.p.y(), n);
    }
    for (const auto& [id, saved] : graph->map.edges) EXPECT_EQ(saved.weight, 1.0 / n);
    EXPECT_EQ(after.reader().working().value()->stamp.sequence, static_cast<std::uint64_t>(n));
  }
}

}  // namespace
}  // namespace perdure::map_store
