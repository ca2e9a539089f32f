// Recordings in places that recorders do not expect: read-only folders, without their log, locked,
// beside other recordings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstring>

#include "common/base/files/sqlite_file.h"
#include "common/replay/dataset.h"
#include "tests/common/base/files/as_nobody.h"
#include "tests/common/replay/ros_twin.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using test::Twin;
using test::twinOf;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

void run(sqlite3* database, const std::string& query) {
  EXPECT_EQ(sqlite3_exec(database, query.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(database);
}

/// Runs a query on a file and closes it.
void change(const fs::path& file, const std::string& query) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  run(database, query);
  sqlite3_close(database);
}

std::uint64_t framesOf(const Twin& twin, const fs::path& path) {
  return Dataset::open({.path = path, .rig = twin.rig})->frameCount();
}

std::string errorOf(const Twin& twin, const fs::path& path) {
  return startupErrorOf([&] { framesOf(twin, path); });
}

TEST(StrangersFolder, ARecordingInWalModeIsReadInAFolderThatCannotBeWritten) {
  const Twin twin = twinOf("ros_read_only");
  const fs::path folder = twin.file.parent_path(), odd = folder / "a?b#c%41.db3";
  fs::rename(twin.file, odd);
  change(odd, "PRAGMA journal_mode=WAL");
  ASSERT_FALSE(fs::exists(odd.string() + "-wal"));
  fs::permissions(folder, fs::perms(0555));
  {
    const tests::AsNobody nobody;
    EXPECT_EQ(framesOf(twin, odd), 5u);
  }
  fs::permissions(folder, fs::perms(0755));
}

TEST(StrangersFolder, ARecordingWithoutItsLogIsNamed) {
  const Twin twin = twinOf("ros_left_behind");
  const fs::path killed = twin.file.parent_path() / "killed.db3",
                 copied = freshFolder("ros_copied") / "killed.db3";
  sqlite3* database = nullptr;  // state after a killed recorder: the main file has no messages
  ASSERT_EQ(sqlite3_open(killed.c_str(), &database), SQLITE_OK);
  run(database, "PRAGMA journal_mode=WAL; PRAGMA wal_autocheckpoint=0; ATTACH '" +
                    twin.file.string() +
                    "' AS from_; CREATE TABLE topics AS SELECT * FROM from_.topics; CREATE TABLE "
                    "messages AS SELECT * FROM from_.messages");
  fs::copy_file(killed, copied);
  EXPECT_THAT(errorOf(twin, copied),
              AllOf(HasSubstr("copied without killed.db3-wal"), HasSubstr("copy that file")));
  const fs::path whole = freshFolder("ros_whole") / "killed.db3";
  fs::copy_file(killed, whole);
  fs::copy_file(killed.string() + "-wal", whole.string() + "-wal");
  const fs::path link = freshFolder("ros_link") / "link.db3";
  fs::create_symlink(whole, link);
  EXPECT_FALSE(lacksWriteAheadLog(link)) << "it is beside the file itself";
  fs::permissions(whole.parent_path(), fs::perms(0555));
  {
    const tests::AsNobody nobody;
    EXPECT_THAT(errorOf(twin, whole), HasSubstr("copy both files"));
    EXPECT_THAT(errorOf(twin, link), HasSubstr("copy both files")) << "not read without its log";
  }
  fs::permissions(whole.parent_path(), fs::perms(0755));
  EXPECT_EQ(framesOf(twin, whole), 5u);
  sqlite3_close(database);
}

TEST(StrangersFolder, ALockedDatabaseIsNamed) {
  const Twin twin = twinOf("ros_locked");
  sqlite3* writer = nullptr;
  ASSERT_EQ(sqlite3_open(twin.file.c_str(), &writer), SQLITE_OK);
  run(writer, "BEGIN EXCLUSIVE");
  const OpenedSqlite opened = openSqliteToRead(twin.file);
  EXPECT_THAT(opened.why, HasSubstr("run_0.db3 is locked by another program"));
  EXPECT_THAT(errorOf(twin, twin.file),
              AllOf(HasSubstr("locked by another"), Not(HasSubstr("no recording"))));
  sqlite3_close(opened.connection);
  sqlite3_close(writer);
}

TEST(StrangersFolder, TwoRecordingsAreRefusedOrJoinedAndReported) {
  const Twin twin = twinOf("ros_two");
  const fs::path folder = twin.file.parent_path(), other = folder / "other.db3";
  fs::copy_file(twin.file, other);
  EXPECT_THAT(errorOf(twin, folder),
              AllOf(HasSubstr("other.db3 and run_0.db3 hold the same topics at the same time"),
                    HasSubstr("give one of the files")));
  change(other, "UPDATE messages SET timestamp = timestamp + 600000000000");
  EXPECT_THAT(Dataset::open({.path = folder, .rig = twin.rig})->recording().notes,
              Contains(HasSubstr("s after the end of run_0.db3; the files are read as one")));
  fs::remove(other);
  fs::copy_file(twin.file, folder / "run.mcap");
  EXPECT_THAT(Dataset::open({.path = folder, .rig = twin.rig})->recording().notes,
              Contains(HasSubstr("run.mcap is left out")));
}

TEST(StrangersFolder, ACameraInfoThatChangesIsReported) {
  const Twin twin = twinOf("ros_zoom");
  const auto notes = [&] {
    return Dataset::open({.path = twin.file, .rig = twin.rig})->recording().notes;
  };
  EXPECT_THAT(notes(), testing::Not(Contains(HasSubstr("camera_info changes"))));
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(twin.file.c_str(), &database), SQLITE_OK);
  const auto zoom = [](sqlite3_context* context, int, sqlite3_value** values) {
    const auto* bytes = static_cast<const char*>(sqlite3_value_blob(values[0]));
    std::string data(bytes, static_cast<std::size_t>(sqlite3_value_bytes(values[0])));
    const double before = 20.0, after = 25.0;  // fx of the tiny camera
    const std::string old(reinterpret_cast<const char*>(&before), sizeof before);
    for (auto at = data.find(old); at != std::string::npos; at = data.find(old, at + 1)) {
      std::memcpy(data.data() + at, &after, sizeof after);
    }
    sqlite3_result_blob(context, data.data(), static_cast<int>(data.size()), SQLITE_TRANSIENT);
  };
  sqlite3_create_function(database, "zoom", 1, SQLITE_UTF8, nullptr, zoom, nullptr, nullptr);
  run(database,
      "INSERT INTO messages(topic_id, timestamp, data) SELECT topic_id, timestamp + 1000000, "
      "zoom(data) FROM messages WHERE topic_id IN (SELECT id FROM topics WHERE name LIKE "
      "'%camera_info%')");
  sqlite3_close(database);
  EXPECT_THAT(notes(), Contains(AllOf(HasSubstr("camera_info changes"),
                                      HasSubstr("20.0 px becomes 25.0 px"))));
}

TEST(StrangersFolder, NamesThatDifferInUnicodeFormOrCaseAreFoundOrNamed) {
  const fs::path drive = tinyEuroc("strange_names");
  const fs::path cam0 = drive / "mav0/cam0";
  std::string list = readText(cam0 / "data.csv");
  const std::string composed = "caf\xC3\xA9_", decomposed = "cafe\xCC\x81_";
  for (const auto& entry : fs::directory_iterator(cam0 / "data")) {
    const std::string name = entry.path().filename().string();
    fs::rename(entry.path(), cam0 / "data" / (decomposed + name));
    const auto at = list.rfind(name);
    ASSERT_NE(at, std::string::npos);
    list.insert(at, composed);
  }
  writeText(cam0 / "data.csv", list);
  const auto dataset = Dataset::open({.path = drive});
  EXPECT_EQ(test::allOf(*dataset).pixels.size(), 5u);
  fs::rename(cam0 / "data.csv", cam0 / "data.CSV");
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = drive}); }),
              AllOf(HasSubstr("data.CSV is there"), HasSubstr("rename it")));
  EXPECT_THAT(
      startupErrorOf([&] { Dataset::open({.path = drive.parent_path() / "Strange_Names"}); }),
      HasSubstr("strange_names is there, whose name differs in case"));
  fs::rename(cam0 / "data.CSV", cam0 / "data.csv.txt");
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = drive}); }),
              HasSubstr("data.csv.txt is there"));
}

TEST(StrangersFolder, ALinkThatLeadsNowhereIsNamed) {
  const fs::path drive = tinyEuroc("dangling");
  fs::remove(drive / "mav0/imu0/data.csv");
  fs::create_symlink("/nowhere/SHA256-1.csv", drive / "mav0/imu0/data.csv");
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = drive}); }),
              HasSubstr("is a link to /nowhere/SHA256-1.csv, which does not exist"));
}

TEST(StrangersFolder, APipeInPlaceOfAFileIsNamed) {
  const fs::path drive = tinyEuroc("pipe");
  fs::remove(drive / "mav0/imu0/data.csv");
  ASSERT_EQ(mkfifo((drive / "mav0/imu0/data.csv").c_str(), 0600), 0);
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = drive}); }), HasSubstr("is a pipe"));
}

TEST(StrangersFolder, DrivesInsideTheFolderAreListed) {
  const fs::path drive = tinyEuroc("outer");
  fs::create_directories(drive / "b");
  fs::rename(drive / "mav0", drive / "b/mav0");
  fs::copy(drive / "b", drive / "a", fs::copy_options::recursive);
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = drive}); }),
              HasSubstr("has a, b inside: give --data one of these"));
}

TEST(StrangersFolder, ADriveThatMayNotBeReadIsNotCalledMissing) {
  const fs::path drive = tinyEuroc("forbidden");
  for (const char* part :
       {"mav0/imu0/sensor.yaml", "mav0/imu0/data.csv", "mav0/cam0/data", "mav0/cam0", "mav0"}) {
    const fs::perms before = fs::status(drive / part).permissions();
    fs::permissions(drive / part, fs::perms(0));
    {
      const tests::AsNobody nobody;
      EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = drive}); }),
                  HasSubstr((drive / part).string() + " may not be read by "));
    }
    fs::permissions(drive / part, before);
  }
}

}  // namespace
}  // namespace perdure::replay
