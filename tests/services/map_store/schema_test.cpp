#include "services/map_store/core/schema.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/errors.h"
#include "services/map_store/core/map_database.h"
#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store {
namespace {

using test::carAt;
using test::TemporaryFolder;
using test::workingSet;
using ::testing::HasSubstr;

void fill(const std::string& path, int count) {
  MapDatabase database({path});
  std::vector<ObjectBelief> cars;
  for (int i = 1; i <= count; ++i) cars.push_back(carAt(static_cast<ObjectId>(i), {i * 1.0, 0, 0}));
  const Objects objects = workingSet(1, cars);
  ASSERT_TRUE(database.write({&objects, {}, {}}).has_value());
}

void overwrite(const std::string& path, std::streamoff from, std::size_t count, char with) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(from);
  file << std::string(count, with);
}

template <class Act>
StartupError refusalOf(Act act) {
  try {
    act();
  } catch (const StartupError& error) {
    return error;
  }
  ADD_FAILURE() << "it was not refused";
  return {ExitCode::kOk, ""};
}

TEST(Schema, MakesTheFolderAndTheFile) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a/b/map.sqlite");
  EXPECT_TRUE(openStore({path}).notice.empty());
  EXPECT_TRUE(std::filesystem::exists(path));
}

TEST(Schema, WritesAheadAndSyncsEveryCommit) {
  const TemporaryFolder folder;
  const auto opened = openStore({folder.file("map.sqlite")});
  auto mode = opened.connection.prepare("PRAGMA journal_mode");
  ASSERT_TRUE(mode.has_value());
  ASSERT_TRUE(mode->step().value());
  EXPECT_EQ(mode->text(0), "wal");
  EXPECT_EQ(opened.connection.integer("PRAGMA synchronous").value(), 2);
}

TEST(Schema, SetsADamagedFileAsideAndKeepsItsBytes) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  fill(path, 200);
  overwrite(path, 4096, 8192, '\x5a');
  const auto size = std::filesystem::file_size(path);
  const auto opened = openStore({path});
  EXPECT_THAT(opened.notice, HasSubstr(path + ".damaged-1"));
  EXPECT_THAT(opened.notice, HasSubstr(".recover"));
  EXPECT_EQ(std::filesystem::file_size(path + ".damaged-1"), size);
  EXPECT_EQ(opened.connection.integer("SELECT count(*) FROM objects").value(), 0);
}

TEST(Schema, NeverOverwritesAnEarlierDamagedFile) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  for (int round = 1; round <= 2; ++round) {
    fill(path, 50);
    overwrite(path, 0, 512, '\0');
    EXPECT_THAT(openStore({path}).notice, HasSubstr(".damaged-" + std::to_string(round)));
  }
  EXPECT_TRUE(std::filesystem::exists(path + ".damaged-1"));
  EXPECT_TRUE(std::filesystem::exists(path + ".damaged-2"));
}

TEST(Schema, RefusesAnotherProgramsDatabaseAndLeavesItAlone) {
  const TemporaryFolder folder;
  const std::string path = folder.file("other.sqlite");
  {
    const auto other = Connection::open(path, Connection::Mode::kReadWriteCreate);
    ASSERT_TRUE(other->execute("CREATE TABLE t(a); INSERT INTO t VALUES(7)").has_value());
  }
  const auto refusal = refusalOf([&] { openStore({path}); });
  EXPECT_EQ(refusal.code(), ExitCode::kConfiguration);
  EXPECT_THAT(refusal.what(), HasSubstr("store.path"));
  const auto other = Connection::open(path, Connection::Mode::kReadOnly);
  EXPECT_EQ(other->integer("SELECT a FROM t").value(), 7);
}

TEST(Schema, RefusesAFileThatIsNoDatabaseAndLeavesItAlone) {
  const TemporaryFolder folder;
  const std::string path = folder.file("notes.txt");
  std::ofstream(path) << "Dear diary, today I saw a white van behind a lorry.";
  EXPECT_EQ(refusalOf([&] { openStore({path}); }).code(), ExitCode::kConfiguration);
  EXPECT_EQ(std::filesystem::file_size(path), 51u);
}

TEST(Schema, RefusesAMapOfANewerVersion) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  fill(path, 1);
  {
    const auto connection = Connection::open(path, Connection::Mode::kReadWriteCreate);
    ASSERT_TRUE(connection->execute("PRAGMA user_version=99").has_value());
  }
  EXPECT_THAT(refusalOf([&] { openStore({path}); }).what(), HasSubstr("schema 99"));
}

TEST(Schema, TakesOverAMapOfTheFirstVersion) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  fill(path, 3);
  const auto version = [&](const char* set) {
    const auto connection = Connection::open(path, Connection::Mode::kReadWriteCreate);
    EXPECT_TRUE(connection->execute(set).has_value());
    return connection->integer("PRAGMA user_version").value();
  };
  EXPECT_EQ(version("PRAGMA user_version=1"), 1);
  EXPECT_EQ(openStoreForReading(path).integer("SELECT count(*) FROM objects").value(), 3);
  EXPECT_EQ(version("SELECT 1"), 1);  // a reader changes nothing
  EXPECT_TRUE(openStore({path}).notice.empty());
  EXPECT_EQ(version("SELECT 1"), 2);
}

TEST(Schema, SaysTheMendWhereTheFolderCannotBeMade) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("file")) << "x";
  const auto refusal = refusalOf([&] { openStore({folder.file("file/map.sqlite")}); });
  EXPECT_EQ(refusal.code(), ExitCode::kUnavailable);
  EXPECT_THAT(refusal.what(), HasSubstr("store.path"));
}

TEST(Schema, ReadsBesideARunningWriter) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  MapDatabase writer({path});
  const Objects objects = workingSet(1, {carAt(3, {1, 2, 3})});
  ASSERT_TRUE(writer.write({&objects, {}, {}}).has_value());
  const Connection reading = openStoreForReading(path);
  EXPECT_EQ(reading.integer("SELECT id FROM objects").value(), 3);
  EXPECT_THROW(openStoreForReading(folder.file("none.sqlite")), StartupError);
}

}  // namespace
}  // namespace perdure::map_store
