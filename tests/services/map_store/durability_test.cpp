// A process that writes the map is killed at any moment: what it said was written is there.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "services/map_store/node.h"
#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store {
namespace {

using namespace std::chrono_literals;
using test::carAt;

/// Confirms one more object a frame and says through `pipe` which id is durable.
[[noreturn]] void writeUntilKilled(const std::string& path, int pipe) {
  Config config;
  config.store_path = path;
  Node node(config, 5,
            {[](const MapTile&) {}, [](const MapTile&) {}, [](const MapHeader&) {},
             [](const MapReply&) {}, [](const Recalled&) {}});
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

}  // namespace
}  // namespace perdure::map_store
