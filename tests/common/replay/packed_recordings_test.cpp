// Recordings that other programs have compressed by zstd: as whole files, or message by message.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <zstd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>

#include "common/replay/dataset.h"
#include "common/replay/recordings/mcap_writer.h"
#include "common/replay/recordings/recorded_messages.h"
#include "common/replay/recordings/recording_writer.h"
#include "common/replay/recordings/ros_messages.h"
#include "tests/common/replay/ros_twin.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using test::Twin;
using test::twinOf;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::string zstdFrame(const std::string& bytes) {
  std::string frame(ZSTD_compressBound(bytes.size()), '\0');
  frame.resize(ZSTD_compress(frame.data(), frame.size(), bytes.data(), bytes.size(), 1));
  return frame;
}

/// Sets TMPDIR to a folder of its own during the test.
class PackedRecording : public testing::Test {
 protected:
  PackedRecording() : place_(freshFolder("ros_unpacked")) {
    if (const char* before = std::getenv("TMPDIR")) before_ = before;
    setenv("TMPDIR", place_.c_str(), 1);
  }
  ~PackedRecording() override {
    before_ ? setenv("TMPDIR", before_->c_str(), 1) : unsetenv("TMPDIR");
  }
  /// Compresses a file into two zstd frames, like writers that write in parts.
  static fs::path packed(const fs::path& file, const fs::path& folder) {
    const std::string bytes = readText(file);
    const fs::path to = folder / (file.filename().string() + ".zstd");
    writeText(to, zstdFrame(bytes.substr(0, bytes.size() / 2)) +
                      zstdFrame(bytes.substr(bytes.size() / 2)));
    return to;
  }
  /// Returns the number of folders with unpacked recordings.
  std::ptrdiff_t unpacked() const {
    return std::count_if(fs::directory_iterator(place_), {}, [](const auto& entry) {
      return entry.path().filename().string().starts_with("perdure-unpacked-");
    });
  }
  fs::path place_;
  std::optional<std::string> before_;
};

TEST_F(PackedRecording, OfRosIsUnpackedForAsLongAsItIsRead) {
  const Twin twin = twinOf("ros_whole", {}, true);
  const fs::path folder = freshFolder("ros_whole_packed"), file = packed(twin.file, folder);
  for (const fs::path& path : {file, folder}) {
    const auto plain = Dataset::open({.path = twin.file, .rig = twin.rig});
    {
      const auto dataset = Dataset::open({.path = path, .rig = twin.rig});
      const test::Given a = test::allOf(*plain), b = test::allOf(*dataset);
      EXPECT_EQ(a.order, b.order);
      EXPECT_EQ(a.pixels, b.pixels);
      EXPECT_THAT(dataset->recording().notes, Contains(HasSubstr("it was unpacked to")));
      EXPECT_EQ(unpacked(), 1) << "once for all cameras";
    }
    EXPECT_EQ(unpacked(), 0);
  }
  fs::copy_file(twin.file, folder / twin.file.filename());
  const auto beside = Dataset::open({.path = folder, .rig = twin.rig});
  EXPECT_EQ(unpacked(), 0) << "somebody has unpacked it";
  EXPECT_EQ(beside->frameCount(), 5u);
}

TEST_F(PackedRecording, ThatCannotBeUnpackedSaysTheFixAndLeavesNothing) {
  const Twin twin = twinOf("ros_unpackable");
  const fs::path folder = freshFolder("ros_unpackable_packed"), file = packed(twin.file, folder);
  const auto error = [&] {
    return startupErrorOf([&] { Dataset::open({.path = folder, .rig = twin.rig}); });
  };
  struct rlimit before {};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{4096, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  const std::string full = error();
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(full, AllOf(HasSubstr("run_0.db3.zstd is packed as a whole"), HasSubstr("TMPDIR")));
  truncate(file, 0.9);
  EXPECT_THAT(error(), HasSubstr("is damaged or cut"));
  writeText(file, "no zstd");
  EXPECT_THAT(error(), AllOf(HasSubstr("is not packed by zstd"), HasSubstr("name it run_0.db3")));
  writeText(file, "\x28\xB5\x2F");
  EXPECT_THAT(error(), HasSubstr("is damaged or cut")) << "what there is of it is zstd's";
  writeText(file, "");
  EXPECT_THAT(error(), HasSubstr("is empty"));
  EXPECT_EQ(unpacked(), 0);
  setenv("TMPDIR", (place_ / "none").c_str(), 1);
  EXPECT_THAT(error(), HasSubstr("set TMPDIR"));
}

TEST_F(PackedRecording, InMcapIsReadToo) {
  const fs::path folder = freshFolder("mcap_whole"), file = folder / "run_0.mcap";
  mcap::Catalogue catalogue;
  catalogue.schemas[1] = {1, "sensor_msgs/msg/Imu", "ros2msg", "float64 x"};
  catalogue.channels[1] = {1, 1, "/imu/data", "cdr"};
  mcap::Draft draft;
  const std::vector<std::uint8_t> data(32, 1);
  for (std::uint64_t i = 0; i < 3; ++i) draft.add({1, 0, 10 + i, 10 + i, data});
  auto writer = mcap::Writer::create(file, "ros2");
  ASSERT_TRUE(writer && writer->append(mcap::pack(draft), catalogue) && writer->finish());
  const fs::path only = packed(file, freshFolder("mcap_whole_packed"));
  EXPECT_TRUE(RosMessages::looksLikeOne(only));
  const RosMessages messages(only);
  ASSERT_TRUE(messages.topics().contains("/imu/data"));
  EXPECT_EQ(messages.topics().at("/imu/data").messages, 3u);
  EXPECT_EQ(messages.notes().size(), 1u);
}

TEST_F(PackedRecording, OfPerdureIsReadAsItsOwn) {
  const fs::path source = tinyEuroc("packed_own_source");
  const fs::path file = freshFolder("packed_own") / "run.mcap";
  RecordingWriter recording(file);
  const auto given = Dataset::open({.path = source});
  recording.add("calibration", given->calibration(), 1);
  std::uint64_t log_ns = 1;
  while (const auto message = given->next()) {
    if (const auto* imu = std::get_if<ImuSample>(&*message)) recording.add("imu", *imu, ++log_ns);
    const auto* frame = std::get_if<Frame>(&*message);
    if (frame) recording.add("frame/" + frame->camera, *frame, ++log_ns);
  }
  ASSERT_TRUE(recording.finish());
  const fs::path folder = freshFolder("packed_own_packed"), only = packed(file, folder);
  EXPECT_FALSE(RosMessages::looksLikeOne(only));
  EXPECT_EQ(RecordedMessages(only).topics().at("frame/cam0").messages, 5u);
  for (const fs::path& path : {only, folder}) {
    const auto plain = Dataset::open({.path = file}), dataset = Dataset::open({.path = path});
    EXPECT_EQ(dataset->kind(), DatasetKind::kRecording);
    const test::Given a = test::allOf(*plain), b = test::allOf(*dataset);
    EXPECT_EQ(a.pixels.size(), 5u);
    EXPECT_EQ(a.pixels, b.pixels);
    EXPECT_THAT(dataset->recording().notes, ElementsAre(HasSubstr("it was unpacked to")));
    EXPECT_EQ(unpacked(), 1);
  }
  EXPECT_EQ(unpacked(), 0);
  fs::rename(only, folder / "run.mcap.zst");
  EXPECT_EQ(Dataset::open({.path = folder / "run.mcap.zst"})->frameCount(), 5u)
      << "zstd's own name";
}

/// Makes a recording of Perdure with three samples of an inertial sensor.
fs::path ownRecording(const std::string& name) {
  const fs::path file = freshFolder(name) / "run.mcap";
  RecordingWriter recording(file);
  for (std::uint64_t i = 1; i < 4; ++i) recording.add("imu", ImuSample(), i);
  EXPECT_TRUE(recording.finish());
  return file;
}

TEST_F(PackedRecording, ThatWasNotFinishedIsNamedAsItWasGiven) {
  const fs::path file = ownRecording("packed_unfinished");
  const std::string bytes = readText(file);
  writeText(file, bytes.substr(0, bytes.size() - 10));
  const fs::path only = packed(file, freshFolder("packed_unfinished_packed"));
  const RecordedMessages messages(only);
  EXPECT_THAT(messages.lastProblem(), AllOf(StartsWith(only.string() + " was not finished"),
                                            HasSubstr("unpack it first (zstd -d " + only.string()),
                                            Not(HasSubstr("perdure-unpacked"))));
}

TEST_F(PackedRecording, ThatASecondOneFollowsSaysSoAndKeepsBoth) {
  const fs::path file = ownRecording("packed_followed");
  const std::string bytes = readText(file);
  writeText(file, bytes + bytes);
  const fs::path only = packed(file, freshFolder("packed_followed_packed"));
  for (const fs::path& path : {file, only}) {
    const RecordedMessages messages(path);
    EXPECT_EQ(messages.topics().at("imu").messages, 3u);
    EXPECT_EQ(messages.reasons().of("followed"), 1u);
    EXPECT_THAT(messages.lastProblem(), StartsWith(path.string() + " holds a second recording"));
  }
  const auto finished = mcap::Reader::open(file)->finish();
  ASSERT_FALSE(finished);
  EXPECT_THAT(finished.error().detail, HasSubstr("a second recording"));
  EXPECT_EQ(readText(file), bytes + bytes);
}

/// Compresses messages like rosbag2 with `compression_mode: MESSAGE`. `cut`: every compressed
/// message except the first loses its last byte.
void packMessages(const fs::path& db3, bool cut = false) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(db3.c_str(), &database), SQLITE_OK);
  const auto pack = [](sqlite3_context* context, int, sqlite3_value** values) {
    const auto* bytes = static_cast<const char*>(sqlite3_value_blob(values[0]));
    const auto size = static_cast<std::size_t>(sqlite3_value_bytes(values[0]));
    std::string frame = zstdFrame({bytes, size});
    if (sqlite3_value_int(values[1]) != 0) frame.pop_back();
    sqlite3_result_blob(context, frame.data(), static_cast<int>(frame.size()), SQLITE_TRANSIENT);
  };
  sqlite3_create_function(database, "pack", 2, SQLITE_UTF8, nullptr, pack, nullptr, nullptr);
  const std::string query = std::string("UPDATE messages SET data = pack(data, ") +
                            (cut ? "id > (SELECT MIN(id) FROM messages)" : "0") + ")";
  EXPECT_EQ(sqlite3_exec(database, query.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(database);
  sqlite3_close(database);
}

TEST(PackedMessages, AreThoseThatWerePacked) {
  const Twin twin = twinOf("ros_packed_messages", {}, true);
  const auto plain = Dataset::open({.path = twin.file, .rig = twin.rig});
  const test::Given a = test::allOf(*plain);
  packMessages(twin.file);
  const auto dataset = Dataset::open({.path = twin.file, .rig = twin.rig});
  const test::Given b = test::allOf(*dataset);
  EXPECT_EQ(a.pixels.size(), 10u);
  EXPECT_EQ(a.order, b.order);
  EXPECT_EQ(a.pixels, b.pixels);
  EXPECT_TRUE(dataset->reasons().all().empty());
}

TEST(PackedMessages, ThatAreDamagedAreCounted) {
  const Twin twin = twinOf("ros_packed_damaged");
  packMessages(twin.file, true);
  RosMessages messages(twin.file);
  std::uint64_t all = 0, read = 0;
  std::set<std::string> wanted;
  for (const auto& [name, topic] : messages.topics()) {
    all += topic.messages;
    wanted.insert(name);
  }
  messages.rewind(wanted);
  while (messages.next()) ++read;
  EXPECT_EQ(read, 1u);
  EXPECT_EQ(messages.reasons().of("message_packing_damaged"), all - 1);
  EXPECT_THAT(messages.lastProblem(), HasSubstr("cannot be unpacked"));
}

TEST(PackedMessages, InMcapAreReadToo) {
  const fs::path file = freshFolder("mcap_messages") / "run_0.mcap";
  mcap::Catalogue catalogue;
  catalogue.schemas[1] = {1, "sensor_msgs/msg/Imu", "ros2msg", "float64 x"};
  catalogue.channels[1] = {1, 1, "/imu/data", "cdr"};
  mcap::Draft draft;
  const std::string bytes("\0\1\0\0 an IMU's sample", 21), frame = zstdFrame(bytes);
  draft.add({1, 0, 10, 10, {reinterpret_cast<const std::uint8_t*>(frame.data()), frame.size()}});
  auto writer = mcap::Writer::create(file, "ros2");
  ASSERT_TRUE(writer && writer->append(mcap::pack(draft), catalogue) && writer->finish());
  RosMessages messages(file);
  messages.rewind({"/imu/data"});
  const auto message = messages.next();
  ASSERT_TRUE(message);
  EXPECT_EQ(std::string(message->data.begin(), message->data.end()), bytes);
}

}  // namespace
}  // namespace perdure::replay
