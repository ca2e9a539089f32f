// Tests the recorder's parts without a bus.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>

#include "common/base/errors.h"
#include "common/replay/recordings/mcap_reader.h"
#include "tests/process/support.h"
#include "tests/tools/record/chunks.h"
#include "tools/record/black_box.h"
#include "tools/record/store.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::uint64_t kNoLimit = 0;

std::vector<fs::path> filesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// Returns the number of messages in a file, with the latched one at its beginning; -1 if it is
/// unfinished.
int messagesIn(const fs::path& file) {
  const auto reader = replay::mcap::Reader::open(file);
  if (!reader || !reader->finished()) return -1;
  return static_cast<int>(reader->statistics().messages);
}

TEST(SegmentWriter, BeginsAFileEachSegmentAndEachWithWhatIsLatched) {
  const test::Folder place;
  SegmentFolder folder(place.file("rec"), kNoLimit, kNoLimit);
  {
    SegmentWriter writer(folder, 10.0, "");
    for (double t = 0; t < 25; t += 1) EXPECT_TRUE(writer.add(chunkAt(t)));
    EXPECT_EQ(writer.files(), 3u);
  }
  const auto files = filesIn(place.file("rec"));
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(files[0].filename(), "perdure-000001-20231114T221320Z.mcap");
  EXPECT_EQ(messagesIn(files[0]), 11);
  EXPECT_EQ(messagesIn(files[1]), 11);
  EXPECT_EQ(messagesIn(files[2]), 6);
}

TEST(SegmentWriter, KeepsTheQuotaByRemovingTheOldest) {
  const test::Folder place;
  constexpr std::uint64_t kQuota = 200'000;
  SegmentFolder folder(place.file("rec"), kQuota, kNoLimit);
  SegmentWriter writer(folder, 60.0, "");
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(writer.add(chunkAt(i, 10'000)));
  writer.finish();
  EXPECT_GT(folder.removed(), 5u);
  std::uint64_t bytes = 0;
  for (const auto& file : filesIn(place.file("rec"))) {
    bytes += fs::file_size(file);
    EXPECT_GT(messagesIn(file), 0);
  }
  EXPECT_LE(bytes, kQuota);
  EXPECT_GT(bytes, kQuota / 2);
  EXPECT_EQ(bytes, folder.bytes());
}

TEST(SegmentWriter, BeginsANewFileAtTheSizeLimitOfFiles) {
  const test::Folder place;
  SegmentFolder folder(place.file("rec"), kNoLimit, kNoLimit);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{200'000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const auto disposition = std::signal(SIGXFSZ, SIG_IGN);
  SegmentWriter writer(folder, 60.0, "");
  for (int i = 0; i < 40; ++i) EXPECT_TRUE(writer.add(chunkAt(i, 10'000)));
  EXPECT_FALSE(writer.add(chunkAt(41, 400'000))) << "no file can hold it";
  EXPECT_THAT(writer.problem(), HasSubstr("File too large"));
  writer.finish();
  std::signal(SIGXFSZ, disposition);
  setrlimit(RLIMIT_FSIZE, &before);
  const auto files = filesIn(place.file("rec"));
  EXPECT_GT(files.size(), 1u);
  for (const auto& file : files) {
    EXPECT_GT(messagesIn(file), 0) << file << " is not finished";
    EXPECT_LE(fs::file_size(file), 200'000u);
  }
}

TEST(SegmentWriter, LeavesTheDiskWhatIsToBeLeft) {
  const test::Folder place;
  constexpr std::uint64_t kMoreThanThereIs = 1ull << 60;
  SegmentFolder folder(place.file("rec"), kNoLimit, kMoreThanThereIs);
  SegmentWriter writer(folder, 60.0, "");
  EXPECT_FALSE(writer.add(chunkAt(0)));
  EXPECT_EQ(writer.problem(), "the disk is full");
  EXPECT_TRUE(writer.diskFull());
  EXPECT_TRUE(filesIn(place.file("rec")).empty());
}

TEST(SegmentWriter, GoesOnInTheSameFileWhenAFullDiskHasRoomAgain) {
  const test::Folder place;
  fs::create_directories(place.file("small"));
  if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
      mount("own", place.file("small").c_str(), "tmpfs", 0, "size=1m") != 0) {
    GTEST_SKIP() << "no right to mount a small disk";
  }
  test::Child filler(
      {"dd", "if=/dev/zero", "of=" + place.file("small/ballast"), "bs=1k", "count=700"},
      place.file("dd.log"));
  ASSERT_EQ(filler.wait(10s), 0);
  int written = 0, lost = 0;
  {
    SegmentFolder folder(place.file("small/rec"), kNoLimit, kNoLimit);
    SegmentWriter writer(folder, 60.0, "");
    for (int i = 0; i < 20; ++i) ++(writer.add(chunkAt(i, 50'000)) ? written : lost);
    EXPECT_GT(written, 3);
    EXPECT_GT(lost, 5);
    EXPECT_THAT(writer.problem(), HasSubstr("No space left on device"));
    fs::remove(place.file("small/ballast"));
    EXPECT_TRUE(writer.add(chunkAt(20, 50'000)));
    EXPECT_EQ(writer.problem(), "");
    EXPECT_EQ(writer.files(), 1u);
  }
  EXPECT_EQ(messagesIn(filesIn(place.file("small/rec"))[0]), written + 1 + 1);
  umount(place.file("small").c_str());
}

TEST(SegmentFolder, FinishesWhatAKilledRecorderLeftAndCountsOn) {
  const test::Folder place;
  fs::create_directories(place.file("rec"));
  const fs::path left = place.file("rec/perdure-000041-20230101T000000Z.mcap");
  {
    auto writer = replay::mcap::Writer::create(left);
    const PackedChunk chunk = chunkAt(0);
    ASSERT_TRUE(writer->append(chunk.chunk, *chunk.catalogue));
  }
  EXPECT_EQ(messagesIn(left), -1);
  SegmentFolder folder(place.file("rec"), kNoLimit, kNoLimit);
  EXPECT_THAT(folder.repaired(), ElementsAre(left.string()));
  EXPECT_EQ(messagesIn(left), 1);
  EXPECT_THAT(folder.nextFile(0, "-fault").filename(),
              "perdure-000042-19700101T000000Z-fault.mcap");
}

TEST(SegmentFolder, HasOneRecorderAtATime) {
  const test::Folder place;
  const SegmentFolder folder(place.file("rec"), kNoLimit, kNoLimit);
  try {
    const SegmentFolder second(place.file("rec"), kNoLimit, kNoLimit);
    FAIL() << "two recorders in one folder";
  } catch (const StartupError& error) {
    EXPECT_THAT(error.what(), HasSubstr("writes to this folder; give --out another one"));
  }
}

TEST(BlackBox, HoldsAtLeastItsSecondsAndNotMuchMore) {
  BlackBox box(10.0, 1 << 30);
  for (double t = 0; t < 60; t += 0.5) {
    box.add(chunkAt(t));
    EXPECT_GE(box.seconds(), std::min(t, 10.0));
    EXPECT_LE(box.seconds(), 10.5);
  }
  const auto chunks = box.take();
  EXPECT_EQ(chunks.front().steady_ns, 49'500'000'000);
  EXPECT_EQ(chunks.back().steady_ns, 59'500'000'000);
  EXPECT_EQ(box.bytes(), 0u);
  EXPECT_EQ(box.cutShort(), 0u);
}

TEST(BlackBox, HoldsLessWhereMemoryIsShortAndCountsIt) {
  BlackBox box(10.0, 12'000);
  for (double t = 0; t < 20; t += 0.5) box.add(chunkAt(t));
  EXPECT_LE(box.bytes(), 12'000u);
  EXPECT_GT(box.seconds(), 3.0);
  EXPECT_GT(box.cutShort(), 10u);
}

TEST(Store, ABlackBoxWritesWhatWasAndWhatFollowsAndThenNoMore) {
  const test::Folder place;
  SegmentFolder folder(place.file("rec"), kNoLimit, kNoLimit);
  {
    Store store({.last_s = 5.0, .after_s = 2.0}, folder);
    for (int i = 0; i < 60; ++i) {
      Store::Job job;
      const auto at = static_cast<std::uint64_t>(i) * 500'000'000;
      const std::vector<std::uint8_t> data(10);
      job.draft.add({1, 0, at, 0, data});
      job.catalogue = oneChannel();
      job.latched = std::make_shared<std::vector<Latched>>();
      job.steady_ns = static_cast<std::int64_t>(at);
      job.fault = i == 40;
      store.give(std::move(job));
      ASSERT_TRUE(
          test::eventually(5s, [&] { return store.report().chunks == std::uint64_t(i) + 1; }));
    }
    EXPECT_EQ(store.report().dumps, 1u);
  }
  const auto files = filesIn(place.file("rec"));
  ASSERT_EQ(files.size(), 1u);
  EXPECT_THAT(files[0].string(), HasSubstr("-fault.mcap"));
  const auto reader = replay::mcap::Reader::open(files[0]);
  EXPECT_TRUE(reader->finished());
  EXPECT_EQ(reader->statistics().start_ns, 15'000'000'000u);  // the fault is at 20 s
  EXPECT_EQ(reader->statistics().end_ns, 22'000'000'000u);
}

Health healthOf(const std::string& process, HealthState state) {
  Health health;
  health.process = process;
  health.state = state;
  return health;
}

TEST(FaultWatch, TellsOnceThatAProcessFails) {
  FaultWatch watch;
  const FaultWatch::Time now{};
  EXPECT_FALSE(watch.onHealth(healthOf("vio", HealthState::kOk), now));
  EXPECT_FALSE(watch.onHealth(healthOf("vio", HealthState::kDegraded), now));
  EXPECT_EQ(watch.onHealth(healthOf("vio", HealthState::kFailed), now), "vio has failed");
  EXPECT_FALSE(watch.onHealth(healthOf("vio", HealthState::kFailed), now));
  EXPECT_FALSE(watch.onHealth(healthOf("vio", HealthState::kOk), now));
  EXPECT_TRUE(watch.onHealth(healthOf("vio", HealthState::kFailed), now));
  EXPECT_TRUE(
      FaultWatch(HealthState::kDegraded).onHealth(healthOf("vio", HealthState::kDegraded), now));
}

TEST(FaultWatch, NamesWhoIsSilent) {
  FaultWatch watch;
  const FaultWatch::Time start{};
  watch.onHealth(healthOf("vio", HealthState::kOk), start);
  watch.onHealth(healthOf("capture", HealthState::kOk), start + 2s);
  EXPECT_FALSE(watch.onSilent(0, start + 2s));
  EXPECT_EQ(watch.onSilent(1, start + 2s), "vio is silent");
  EXPECT_FALSE(watch.onSilent(1, start + 3s));
  EXPECT_FALSE(watch.onSilent(0, start + 4s));
}

}  // namespace
}  // namespace perdure::tools
