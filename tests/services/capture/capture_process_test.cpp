// Tests perdure-capture as a process: a small drive over loopback, restarts, paced by its readers,
// and damaged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <map>
#include <memory>

#include "tests/process/support.h"
#include "tests/services/capture/tiny_drive.h"
#include "tests/services/run_until.h"

namespace perdure::capture {
namespace {

using namespace std::chrono_literals;
using test::Child;
using test::runUntil;
using ::testing::HasSubstr;

/// Acts as "vio" on the bus.
class CaptureProcess : public ::testing::Test {
 protected:
  CaptureProcess() {
    loop_.on(calibrations_, [this](const Calibration& c) { calibration_ = c; });
    loop_.on(imu_, [this](const ImuSample& s) { samples_.push_back(toNanoseconds(s.time)); });
    loop_.on(frames_, [this](const Frame& f) {
      sequences_.push_back(f.stamp.sequence);
      sources_[f.stamp.source].push_back(f.stamp.sequence);
      if (answers_) answer(f.stamp);
    });
    loop_.on(health_, [this](const Health& h) { last_health_ = h; });
  }
  void answer(const FrameStamp& stamp) {
    Odometry odometry;
    odometry.stamp = stamp;
    odometry.instance = 5;
    EXPECT_TRUE(odometry_.write(odometry));
  }
  std::unique_ptr<Child> start(const testing::TinyDrive& drive,
                               std::vector<std::string> more = {}) {
    std::vector<std::string> command = {(test::programs() / "perdure-capture").string(),
                                        "--set",
                                        "dataset.path=" + drive.write(folder_.file("drive")),
                                        "--set",
                                        "start.readers=[vio]",
                                        "--set",
                                        "run.state=" + folder_.file("run")};
    for (const std::string& assignment : more) {
      command.push_back("--set");
      command.push_back(assignment);
    }
    return std::make_unique<Child>(command, folder_.file("log" + std::to_string(++starts_)));
  }
  bool ended() const { return last_health_.message == "end of drive"; }

  test::Folder folder_;
  bus::Domain domain_{test::ownNetwork()};
  bus::Participant participant_{domain_, "vio"};
  bus::Reader<Frame> frames_{participant_, bus::frameTopic("cam0")};
  bus::Reader<ImuSample> imu_{participant_, bus::kTopic<ImuSample>};
  bus::Reader<Calibration> calibrations_{participant_, bus::kTopic<Calibration>};
  bus::Reader<Health> health_{participant_, bus::kTopic<Health>};
  bus::Writer<Odometry> odometry_{participant_, bus::kTopic<Odometry>};
  bus::WaitLoop loop_{participant_};
  bool answers_ = false;
  int starts_ = 0;
  Calibration calibration_;
  Health last_health_;
  std::vector<std::uint64_t> sequences_;
  std::vector<std::int64_t> samples_;
  std::map<InstanceId, std::vector<std::uint64_t>> sources_;
};

std::vector<std::uint64_t> upTo(std::uint64_t end) {
  std::vector<std::uint64_t> all(end);
  for (std::uint64_t i = 0; i < end; ++i) all[i] = i;
  return all;
}

TEST_F(CaptureProcess, GivesEveryFrameAndSampleOnceAndExits) {
  const testing::TinyDrive drive;  // 20 frames, one sample every 10 ms from -20 ms to +1050 ms
  auto capture = start(drive, {"run.on_end=exit"});
  ASSERT_TRUE(runUntil(loop_, [&] { return ended(); })) << capture->log();
  EXPECT_EQ(capture->wait(5s), 0) << capture->log();
  EXPECT_EQ(sequences_, upTo(20));
  EXPECT_EQ(samples_.size(), 108u);
  EXPECT_TRUE(std::is_sorted(samples_.begin(), samples_.end()));
  ASSERT_EQ(calibration_.cameras.size(), 1u);
  EXPECT_EQ(calibration_.cameras[0].width, 16u);
}

TEST_F(CaptureProcess, StaysForLateReadersAndEndsWithinASecondWhenTold) {
  auto capture = start({.frames = 3});
  ASSERT_TRUE(runUntil(loop_, [&] { return ended(); })) << capture->log();
  EXPECT_EQ(last_health_.state, HealthState::kOk);
  bus::Participant late(domain_, "late");
  bus::Reader<Calibration> calibrations(late, bus::kTopic<Calibration>);
  bus::WaitLoop loop(late);
  bool got = false;
  loop.on(calibrations, [&](const Calibration&) { got = true; });
  EXPECT_TRUE(runUntil(loop, [&] { return got; }));
  capture->signal(SIGTERM);
  EXPECT_EQ(capture->wait(1s), 0) << capture->log();
}

TEST_F(CaptureProcess, CarriesOnInTheDriveWhenItIsKilledAndStartedAgain) {
  testing::TinyDrive drive;
  drive.frames = 80;
  auto first = start(drive);
  ASSERT_TRUE(runUntil(loop_, [&] { return sequences_.size() >= 20; })) << first->log();
  first->signal(SIGKILL);
  first->wait(5s);
  const std::uint64_t last = sequences_.back();
  auto second = start(drive, {"run.on_end=exit"});
  ASSERT_TRUE(runUntil(loop_, [&] { return ended(); })) << second->log();
  EXPECT_EQ(second->wait(5s), 0);
  ASSERT_EQ(sources_.size(), 2u) << "each process is a source of its own";
  EXPECT_GT(sequences_[last + 1], last) << "nothing twice";
  EXPECT_EQ(sequences_.back(), 79u) << "and it ends with the drive's last frame";
  EXPECT_TRUE(std::is_sorted(sequences_.begin(), sequences_.end()));
  const std::uint64_t missed = 80 - sequences_.size();
  // The frame that was being sent at the kill may or may not have reached the reader.
  EXPECT_NEAR(static_cast<double>(last_health_.reasons["missed_while_away"]),
              static_cast<double>(missed), 1.0)
      << "frames that went by are counted";
  EXPECT_GE(samples_.size(), 408u) << "samples that went by come late";
}

TEST_F(CaptureProcess, AKilledEndOfDriveIsStillTheEnd) {
  auto first = start({.frames = 5});
  ASSERT_TRUE(runUntil(loop_, [&] { return ended(); })) << first->log();
  first->signal(SIGKILL);
  first->wait(5s);
  last_health_ = {};
  auto second = start({.frames = 5});
  ASSERT_TRUE(runUntil(loop_, [&] { return ended(); })) << second->log();
  EXPECT_EQ(sequences_, upTo(5));
}

TEST_F(CaptureProcess, FollowsItsReadersAndResumesAtTheFirstFrameWithoutAnAnswer) {
  answers_ = true;
  testing::TinyDrive drive;
  drive.frames = 200;
  drive.frame_period_ns = 1'000'000'000;  // in real time it would take 200 s
  auto first = start(drive, {"pace.mode=follow"});
  ASSERT_TRUE(runUntil(loop_, [&] { return sequences_.size() >= 50; })) << first->log();
  answers_ = false;
  const std::size_t unanswered = sequences_.size();
  ASSERT_TRUE(runUntil(loop_, [&] { return sequences_.size() > unanswered; }));
  first->signal(SIGKILL);
  first->wait(5s);
  const std::uint64_t open = sequences_.back();
  answers_ = true;
  auto second = start(drive, {"pace.mode=follow", "run.on_end=exit"});
  ASSERT_TRUE(runUntil(loop_, [&] { return ended(); })) << second->log();
  EXPECT_EQ(second->wait(5s), 0);
  ASSERT_EQ(sources_.size(), 2u);
  std::vector<std::uint64_t> expected = upTo(200);
  expected.insert(expected.begin() + static_cast<std::ptrdiff_t>(open), open);  // this frame is
                                                                                // sent again
  EXPECT_EQ(sequences_.size(), expected.size());
  const auto [got, wanted] =
      std::mismatch(sequences_.begin(), sequences_.end(), expected.begin(), expected.end());
  EXPECT_TRUE(got == sequences_.end() && wanted == expected.end())
      << "they part at " << (got == sequences_.end() ? 0 : *got) << ", killed at " << open;
}

TEST_F(CaptureProcess, SaysWhomItWaitsFor) {
  auto capture = start({.frames = 3}, {"start.readers=[vio, inference]"});
  ASSERT_TRUE(runUntil(loop_, [&] {
    return last_health_.message == "waits for readers: inference";
  })) << last_health_.message;
  EXPECT_EQ(last_health_.state, HealthState::kStarting);
  EXPECT_TRUE(sequences_.empty());
}

TEST_F(CaptureProcess, StartsWithoutAReaderThatDoesNotComeAndCountsIt) {
  auto capture = start({.frames = 3}, {"start.readers=[vio, inference]", "start.timeout_s=1.5"});
  ASSERT_TRUE(runUntil(loop_, [&] { return ended(); })) << capture->log();
  EXPECT_EQ(sequences_, upTo(3));
  EXPECT_EQ(last_health_.reasons["reader_missing_inference"], 1u);
}

TEST_F(CaptureProcess, CountsATruncatedImageAndAGapOfTheImuInHealth) {
  testing::TinyDrive drive;
  drive.truncated = 7;
  drive.imu_gap_after = 3;
  auto capture = start(drive);
  ASSERT_TRUE(runUntil(loop_, [&] { return ended(); })) << capture->log();
  EXPECT_EQ(sequences_.size(), 19u);
  EXPECT_EQ(last_health_.reasons["image_truncated"] + last_health_.reasons["image_corrupt"], 1u);
  EXPECT_EQ(last_health_.reasons["imu_gap"], 1u);
}

TEST(CaptureProgram, SaysTheFixAndTheStatusWhereItCannotStart) {
  test::ownNetwork();
  test::Folder folder;
  const std::string program = (test::programs() / "perdure-capture").string();
  Child missing({program, "--set", "dataset.path=/nowhere"}, folder.file("missing"));
  EXPECT_EQ(missing.wait(10s), 69);
  EXPECT_THAT(missing.log(), HasSubstr("/nowhere"));
  const std::string drive = testing::TinyDrive{.frames = 2}.write(folder.file("drive"));
  std::filesystem::remove(folder.file("drive/mav0/cam0/sensor.yaml"));
  Child uncalibrated({program, "--set", "dataset.path=" + drive}, folder.file("uncalibrated"));
  EXPECT_EQ(uncalibrated.wait(10s), 69);
  EXPECT_THAT(uncalibrated.log(), HasSubstr("sensor.yaml"));
  Child live({program, "--set", "source=libcamera"}, folder.file("live"));
  EXPECT_EQ(live.wait(10s), 78);
  EXPECT_THAT(live.log(), HasSubstr("source: libcamera needs rig"));
}

}  // namespace
}  // namespace perdure::capture
