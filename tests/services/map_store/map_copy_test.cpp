#include "services/map_store/core/map_copy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "common/base/errors.h"
#include "common/base/files/sqlite_file.h"
#include "services/map_store/core/map_database.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/services/map_store/graphs.h"

namespace perdure::map_store {
namespace {

using test::bitsOf;
using test::carAt;
using test::workingSet;
using ::testing::HasSubstr;

class MapCopy : public ::testing::Test {
 protected:
  MapCopy() : from_(folder_.file("from.sqlite")), to_(folder_.file("new/to.sqlite")) {}

  /// Writes `count` objects and a graph.
  void write(MapDatabase& database, std::size_t count) {
    std::vector<ObjectBelief> cars;
    for (ObjectId id = 1; id <= count; ++id) {
      cars.push_back(carAt(id, {static_cast<double>(id), 0, 0}));
    }
    const Objects objects = workingSet(count, cars);
    const mapping::Unsaved graph{map_, {}, {}};
    Batch batch{&objects, {}, {}};
    batch.graph = batch.facts = &graph;
    ASSERT_TRUE(database.write(batch).has_value());
  }
  void expectCopy(std::size_t count) const {
    const MapDatabase copy({to_});
    EXPECT_TRUE(copy.notice().empty()) << copy.notice();
    EXPECT_EQ(copy.reader().beliefs().value().size(), count);
    EXPECT_TRUE(bitsOf(copy.reader().graph().value().map) == bitsOf(map_));
    EXPECT_EQ(copy.reader().working().value()->objects.size(), count);
  }
  StartupError refusal() const {
    try {
      copyMap(from_, to_);
    } catch (const StartupError& error) {
      return error;
    }
    ADD_FAILURE() << "it was not refused";
    return {ExitCode::kOk, ""};
  }
  /// Whether no files of a failed copy are left.
  bool nothingThere() const {
    for (const char* suffix : {"", ".part", ".part-wal", ".part-shm", ".part-journal"}) {
      if (std::filesystem::exists(to_ + suffix)) return false;
    }
    return true;
  }

  const test::TemporaryFolder folder_;
  const std::string from_, to_;
  const mapping::SavedMap map_ = test::RandomGraph(5).map({});
};

std::string contentsOf(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST_F(MapCopy, HasAllAndLeavesTheOtherAsItWas) {
  {
    MapDatabase database({from_});
    write(database, 30);
  }
  const std::string before = contentsOf(from_);
  copyMap(from_, to_);
  expectCopy(30);
  EXPECT_TRUE(contentsOf(from_) == before);
  EXPECT_FALSE(std::filesystem::exists(to_ + ".part"));
}

TEST_F(MapCopy, HasWhatAServiceHasCommittedThatGoesOnWriting) {
  MapDatabase database({from_});
  write(database, 20);
  ASSERT_GT(std::filesystem::file_size(from_ + "-wal"), 0u);  // not in the main file yet
  copyMap(from_, to_);
  write(database, 25);
  expectCopy(20);
  EXPECT_EQ(database.reader().beliefs().value().size(), 25u);
}

TEST_F(MapCopy, DoesNotWaitForACommitThatIsNotThrough) {
  MapDatabase database({from_});
  write(database, 20);
  const auto other = Connection::open(from_, Connection::Mode::kReadWriteCreate);
  ASSERT_TRUE(
      other->execute("BEGIN IMMEDIATE; DELETE FROM objects; DELETE FROM anchors").has_value());
  copyMap(from_, to_);
  ASSERT_TRUE(other->execute("COMMIT").has_value());
  expectCopy(20);
}

TEST_F(MapCopy, KeepsAnOlderSchemaUntilItIsOpened) {
  {
    MapDatabase database({from_});
    write(database, 3);
  }
  {
    const auto connection = Connection::open(from_, Connection::Mode::kReadWriteCreate);
    ASSERT_TRUE(connection
                    ->execute("DROP VIEW objects_in_map; DROP TABLE anchors; DROP TABLE edges;"
                              "DROP TABLE anchor_poses; DROP TABLE sightings;"
                              "DROP TABLE graph_classes; DROP TABLE same; DROP TABLE tracks;"
                              "DROP TABLE track_sightings; DROP TABLE views;"
                              "PRAGMA user_version=2")
                    .has_value());
  }
  copyMap(from_, to_);
  EXPECT_EQ(openStoreForReading(to_).integer("PRAGMA user_version").value(), 2);
  const MapDatabase copy({to_});
  EXPECT_EQ(copy.reader().beliefs().value().size(), 3u);
  EXPECT_EQ(openStoreForReading(from_).integer("PRAGMA user_version").value(), 2);
}

TEST_F(MapCopy, SaysThatThereIsNoMap) {
  const auto error = refusal();
  EXPECT_EQ(error.code(), ExitCode::kUnavailable);
  EXPECT_THAT(error.what(), HasSubstr("no map " + from_));
  EXPECT_FALSE(std::filesystem::exists(from_));
  EXPECT_FALSE(std::filesystem::exists(folder_.file("new")));
}

TEST_F(MapCopy, SaysThatItIsNoMap) {
  std::ofstream(from_) << "Dear diary, today I saw a white van behind a lorry.";
  EXPECT_EQ(refusal().code(), ExitCode::kConfiguration);
  EXPECT_THAT(refusal().what(), HasSubstr("not a map"));
  std::ofstream(from_, std::ios::trunc).flush();
  EXPECT_THAT(refusal().what(), HasSubstr("is empty (0 bytes) and no map"));
  std::filesystem::remove(from_);
  ASSERT_TRUE(Connection::open(from_, Connection::Mode::kReadWriteCreate)
                  ->execute("CREATE TABLE t(a)")
                  .has_value());
  EXPECT_THAT(refusal().what(), HasSubstr("not a map"));
  std::filesystem::remove(from_);
  std::filesystem::create_directory(from_);
  EXPECT_EQ(refusal().code(), ExitCode::kUnavailable);
  EXPECT_TRUE(nothingThere());
}

TEST_F(MapCopy, SaysThatTheSchemaIsNewer) {
  {
    MapDatabase database({from_});
    write(database, 3);
  }
  ASSERT_TRUE(Connection::open(from_, Connection::Mode::kReadWriteCreate)
                  ->execute("PRAGMA user_version=99")
                  .has_value());
  EXPECT_EQ(refusal().code(), ExitCode::kConfiguration);
  EXPECT_THAT(refusal().what(), HasSubstr("schema 99"));
  EXPECT_TRUE(nothingThere());
}

TEST_F(MapCopy, SaysThatTheMapIsDamagedAndKeepsNothingOfIt) {
  {
    MapDatabase database({from_});
    write(database, 200);
  }
  {
    std::fstream file(from_, std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(8 * 4096);
    file << std::string(4096, '\x5a');
  }
  const auto error = refusal();
  EXPECT_EQ(error.code(), ExitCode::kUnavailable);
  EXPECT_THAT(error.what(), HasSubstr("damaged"));
  EXPECT_THAT(error.what(), HasSubstr(".recover"));
  EXPECT_TRUE(nothingThere());
}

TEST_F(MapCopy, OverwritesNothing) {
  {
    MapDatabase database({from_});
    write(database, 3);
  }
  std::filesystem::create_directory(folder_.file("new"));
  for (const char* suffix : {"", "-wal", "-journal"}) {
    std::ofstream(to_ + suffix) << "precious";
    EXPECT_THAT(refusal().what(), HasSubstr(to_ + suffix + " is there already"));
    EXPECT_EQ(contentsOf(to_ + suffix), "precious");
    std::filesystem::remove(to_ + suffix);
  }
  const std::string before = contentsOf(from_);
  EXPECT_THROW(copyMap(from_, from_), StartupError);
  EXPECT_TRUE(contentsOf(from_) == before);
}

TEST_F(MapCopy, SaysWhereItCannotBeWrittenAndLeavesNoPart) {
  {
    MapDatabase database({from_});
    write(database, 300);
  }
  std::ofstream(folder_.file("file")) << "x";
  EXPECT_THROW(copyMap(from_, folder_.file("file/to.sqlite")), StartupError);
  const pid_t child = fork();
  if (child == 0) {  // in this process no file may exceed 100 kB
    signal(SIGXFSZ, SIG_IGN);
    const rlimit small{100'000, 100'000};
    if (setrlimit(RLIMIT_FSIZE, &small) != 0) _exit(2);
    try {
      copyMap(from_, to_);
    } catch (const StartupError& error) {
      const std::string text = error.what();
      const bool says = text.find(to_ + " cannot be written") == 8 &&
                        text.find("ulimit -f") != std::string::npos;
      _exit(error.code() == ExitCode::kInputOutput && says ? 0 : 3);
    }
    _exit(1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(nothingThere());
}

TEST_F(MapCopy, AMapIsReadUnderASizeLimitOfFiles) {
  {
    MapDatabase database({from_});
    write(database, 3);
  }
  const pid_t child = fork();
  if (child == 0) {  // SQLite would make a file of 32 KiB beside the map
    signal(SIGXFSZ, SIG_IGN);
    const rlimit small{8'000, 8'000};
    if (setrlimit(RLIMIT_FSIZE, &small) != 0) _exit(2);
    const auto opened = openSqliteToRead(from_);
    _exit(opened.code == 0 ? 0 : 3);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace perdure::map_store
