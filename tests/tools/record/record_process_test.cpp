// Runs `perdure record` and `perdure play` on topics that this test publishes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <thread>

#include "common/bus/wait_loop.h"
#include "common/replay/recordings/recorded_messages.h"
#include "common/replay/recordings/recording_writer.h"
#include "common/types/map.h"
#include "tests/process/support.h"
#include "tests/services/gateway/objects.h"
#include "tests/services/semantic_filter/scene.h"
#include "tests/tools/record/recorded_file.h"
#include "tools/pipeline/pipeline.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
namespace scene = semantic_filter::testing;
using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;

std::vector<fs::path> filesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::exists(folder)) return files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// Publishes inertial samples at 200 Hz, odometry and images at 20 Hz and a calibration until its
/// destruction.
class Vehicle {
 public:
  Vehicle()
      : domain_(test::ownNetwork()),
        participant_(domain_, "vehicle"),
        imu_(participant_, bus::kTopic<ImuSample>),
        odometry_(participant_, bus::kTopic<Odometry>),
        frames_(participant_, bus::frameTopic("cam0")),
        calibration_(participant_, bus::kTopic<Calibration>),
        health_(participant_, bus::kTopic<Health>),
        loop_(participant_) {
    Calibration calibration = scene::calibrationOf(scene::makeCamera());
    calibration.source = 77;
    (void)calibration_.write(calibration);
    loop_.every(5ms, [this] { publish(); });
    loop_.every(1s, [this] { sayHealth(); });
    thread_ = std::thread([this] { loop_.run(); });
  }
  ~Vehicle() {
    loop_.stop();
    thread_.join();
  }
  bool heard() const { return imu_.matched() > 0 && odometry_.matched() > 0; }
  std::uint64_t published() const { return published_; }
  void fail() { state_ = HealthState::kFailed; }

 private:
  void publish() {
    ImuSample sample;
    sample.sequence = published_;
    (void)imu_.write(sample);
    if (published_ % 10 == 0) {
      (void)odometry_.write(scene::odometryAt(published_ / 10, RigidTransform()));
      Frame frame;
      frame.camera = "cam0";
      frame.width = frame.height = 16;
      frame.data = std::make_shared<const std::vector<std::uint8_t>>(256, std::uint8_t{70});
      (void)frames_.write(frame);
    }
    ++published_;
  }
  void sayHealth() {
    Health health;
    health.process = "vehicle";
    health.state = state_;
    (void)health_.write(health);
  }

  bus::Domain domain_;
  bus::Participant participant_;
  bus::Writer<ImuSample> imu_;
  bus::Writer<Odometry> odometry_;
  bus::Writer<Frame> frames_;
  bus::Writer<Calibration> calibration_;
  bus::Writer<Health> health_;
  bus::WaitLoop loop_;
  std::atomic<std::uint64_t> published_ = 0;
  std::atomic<HealthState> state_ = HealthState::kOk;
  std::thread thread_;
};

/// Returns the first and last sequence number of the inertial samples; a gap fails the test.
std::pair<std::int64_t, std::int64_t> imuSpan(const fs::path& path, std::uint64_t* calibrations) {
  replay::RecordedMessages messages(path);
  std::int64_t first = -1, last = -1;
  while (const auto message = messages.next()) {
    if (message->topic == "calibration") ++*calibrations;
    if (message->topic != "imu") continue;
    const auto number = static_cast<std::int64_t>(replay::valueOf<ImuSample>(*message)->sequence);
    if (first >= 0 && number != last + 1) ADD_FAILURE() << last << " is followed by " << number;
    if (first < 0) first = number;
    last = number;
  }
  return {first, last};
}

TEST(RecordProcess, KilledLosesLessThanASecondAndTheNextOneMakesTheFileWhole) {
  const test::Folder place;
  const std::string out = place.file("rec");
  (void)test::ownNetwork();
  Vehicle vehicle;
  std::uint64_t before = 0;
  {
    test::Child recorder({perdure(), "record", "--out", out}, place.file("record.log"));
    ASSERT_TRUE(test::eventually(20s, [&] { return vehicle.heard(); })) << recorder.log();
    const std::uint64_t start = vehicle.published();
    ASSERT_TRUE(test::eventually(20s, [&] { return vehicle.published() > start + 350; }));
    before = vehicle.published();
    recorder.signal(SIGKILL);
    recorder.wait(5s);
  }
  const auto files = filesIn(out);
  ASSERT_EQ(files.size(), 1u);
  EXPECT_EQ(stateOf(files[0]), "unfinished");
  std::uint64_t calibrations = 0;
  const auto [first, last] = imuSpan(out, &calibrations);
  EXPECT_EQ(calibrations, 1u);
  // at most one second of the messages is missing
  EXPECT_GT(last, static_cast<std::int64_t>(before) - 200);
  EXPECT_GT(last - first, 150);
  test::Child next({perdure(), "record", "--out", out, "--seconds", "0.3"}, place.file("next.log"));
  EXPECT_EQ(next.wait(20s), 0);
  EXPECT_THAT(next.log(), HasSubstr("had been cut off and is whole again"));
  EXPECT_EQ(stateOf(files[0]), "finished");
  EXPECT_EQ(filesIn(out).size(), 2u);
}

TEST(RecordProcess, ImagesHaveChunksOfTheirOwn) {
  const test::Folder place;
  (void)test::ownNetwork();
  Vehicle vehicle;
  test::Child recorder(
      {perdure(), "record", "--images", "--out", place.file("rec"), "--seconds", "3"},
      place.file("record.log"));
  ASSERT_EQ(recorder.wait(30s), 0) << recorder.log();
  const auto file = replay::mcap::Reader::open(filesIn(place.file("rec")).at(0));
  ASSERT_TRUE(file);
  std::size_t of_images = 0;
  for (const auto& chunk : file->chunks()) {
    std::size_t images = 0;
    for (const auto& [channel, offset] : chunk.index_offsets)
      images += file->catalogue().channels.at(channel).topic.ends_with("frame/cam0") ? 1 : 0;
    EXPECT_TRUE(images == 0 || chunk.index_offsets.size() == 1);
    of_images += images;
  }
  EXPECT_GT(of_images, 1u);
}

TEST(RecordProcess, WhatIsLostToAFullDiskEndsWith74) {
  const test::Folder place;
  (void)test::ownNetwork();
  Vehicle vehicle;
  test::Child recorder({perdure(), "record", "--out", place.file("rec"), "--keep-free", "1000000TB",
                        "--seconds", "2"},
                       place.file("record.log"));
  EXPECT_EQ(recorder.wait(20s), 74);
  EXPECT_THAT(recorder.log(), HasSubstr("messages were lost and are in no file: the disk is full"));
  EXPECT_THAT(recorder.log(), Not(HasSubstr("recording goes on")));
}

TEST(LongRecordProcess, TheBlackBoxWritesTheTimeBeforeAFaultAndWhatIsLatched) {
  const test::Folder place;
  const std::string out = place.file("rec");
  (void)test::ownNetwork();
  Vehicle vehicle;
  test::Child recorder({perdure(), "record", "--out", out, "--last", "2s", "--after", "0.5"},
                       place.file("record.log"));
  ASSERT_TRUE(test::eventually(20s, [&] { return vehicle.heard(); })) << recorder.log();
  const std::uint64_t start = vehicle.published();
  ASSERT_TRUE(test::eventually(20s, [&] { return vehicle.published() > start + 700; }));
  EXPECT_TRUE(filesIn(out).empty());
  vehicle.fail();
  const auto finished = [&](std::size_t n) {
    const auto files = filesIn(out);
    return files.size() == n && stateOf(files.back()) == "finished";
  };
  ASSERT_TRUE(test::eventually(10s, [&] { return finished(1); })) << recorder.log();
  EXPECT_THAT(recorder.log(), HasSubstr("fault: vehicle has failed"));
  std::uint64_t calibrations = 0;
  const auto [first, last] = imuSpan(out, &calibrations);
  EXPECT_EQ(calibrations, 1u);
  EXPECT_GT(first,
            static_cast<std::int64_t>(start));  // the calibration is older than the ring buffer's
                                                // span
  EXPECT_GT(last - first, 2 * 150);             // two seconds, at 200 Hz on a busy machine
  recorder.signal(SIGUSR1);
  ASSERT_TRUE(test::eventually(10s, [&] { return finished(2); })) << recorder.log();
  {
    test::Child store({(test::programs() / "perdure-map-store").string(), "--set",
                       "store.path=" + place.file("map.sqlite")},
                      place.file("store.log"));
    std::this_thread::sleep_for(2s);
    store.signal(SIGKILL);
    ASSERT_TRUE(test::eventually(10s, [&] { return finished(3); })) << recorder.log();
  }
  EXPECT_THAT(recorder.log(), HasSubstr("fault: map_store is silent"));
  recorder.signal(SIGTERM);
  EXPECT_EQ(recorder.wait(5s), 0);
}

TEST(PlayProcess, RefusesTopicsThatOthersWriteUnlessItIsForced) {
  const test::Folder place;
  replay::RecordingWriter recording(place.file("run.mcap"));
  recording.add("imu", ImuSample{}, 1000);
  recording.finish();
  (void)test::ownNetwork();
  const Vehicle vehicle;
  test::Child player({perdure(), "play", place.file("run.mcap")}, place.file("play.log"));
  EXPECT_EQ(player.wait(20s), 69);
  EXPECT_THAT(player.log(), HasSubstr("others write these topics now: imu (vehicle)"));
  test::Child forced({perdure(), "play", place.file("run.mcap"), "--force", "--wait", "0"},
                     place.file("forced.log"));
  EXPECT_EQ(forced.wait(20s), 0);
  EXPECT_THAT(forced.log(), HasSubstr("1 messages of 1 topics were played"));
}

/// Topics that map_store writes itself are not played; events of the filter are played.
TEST(PlayProcess, PlaysBesideAMapStoreAndSaysWhatIsLeftOut) {
  const test::Folder place;
  replay::RecordingWriter recording(place.file("run.mcap"));
  constexpr std::uint64_t kEach = 100'000'000;
  for (std::uint64_t i = 0; i < 10; ++i) {
    recording.add("objects", gateway::test::frameOf(i, {}), i * kEach);
    MapFrame frame;
    frame.world = frame.map = {77, 1};
    recording.add("map/frame", frame, i * kEach);
  }
  recording.add("events", gateway::test::eventOf(EventKind::kBorn, 1), 10 * kEach);
  recording.add("events", gateway::test::eventOf(EventKind::kLoopClosed, 0), 10 * kEach);
  recording.finish();
  (void)test::ownNetwork();
  test::Child store({(test::programs() / "perdure-map-store").string(), "--set",
                     "store.path=" + place.file("map.sqlite")},
                    place.file("store.log"));
  test::Child player({perdure(), "play", place.file("run.mcap")}, place.file("play.log"));
  EXPECT_EQ(player.wait(30s), 0);
  const std::string said = player.log();
  EXPECT_THAT(said, HasSubstr("11 messages of 2 topics were played"));
  EXPECT_THAT(said, HasSubstr("who listens: map/frame (map_store)"));
  EXPECT_THAT(said, HasSubstr("who listens: those of map_store among events"));
  EXPECT_THAT(said, HasSubstr("events_left_out: 1"));
  test::Child named({perdure(), "play", place.file("run.mcap"), "--topics", "map/frame"},
                    place.file("named.log"));
  EXPECT_EQ(named.wait(20s), 69);
  EXPECT_THAT(named.log(), HasSubstr("map/frame (map_store)"));
}

TEST(PlayProcess, SaysWhatTheRecordingHasNot) {
  const test::Folder place;
  replay::RecordingWriter recording(place.file("run.mcap"));
  recording.add("imu", ImuSample{}, 1000);
  recording.finish();
  (void)test::ownNetwork();
  test::Child player({perdure(), "play", place.file("run.mcap"), "--for", "semantic_filter"},
                     place.file("play.log"));
  EXPECT_EQ(player.wait(20s), 64);
  EXPECT_THAT(player.log(), HasSubstr("the recording has no such topic"));
}

TEST(PlayProcess, DoesNotWaitForHoursInWhichNothingWasRecorded) {
  const test::Folder place;
  constexpr std::uint64_t kHour = 3'600'000'000'000;
  replay::RecordingWriter recording(place.file("run.mcap"));
  for (const std::uint64_t at : {std::uint64_t{1000}, kHour, 2 * kHour, UINT64_MAX - 1}) {
    recording.add("imu", ImuSample{}, at);
    recording.cut();
  }
  recording.finish();
  (void)test::ownNetwork();
  test::Child player({perdure(), "play", place.file("run.mcap"), "--wait", "0"},
                     place.file("play.log"));
  EXPECT_EQ(player.wait(20s), 0);
  EXPECT_THAT(player.log(), HasSubstr("4 messages of 1 topics were played"));
  EXPECT_THAT(player.log(), HasSubstr("gaps_left_out: 3"));
}

/// Records the messages of vio and inference for a street with two cars: odometry, and its
/// detections half a period later. Frames are .1 s apart for the filter, and .2 s in log time. The
/// first is a second after the calibration, so that all programs have found each other by then.
void recordStreet(const std::string& file) {
  constexpr std::uint64_t kPeriod = 200'000'000, kFrames = 20, kStart = 1'000'000'000;
  const std::vector<scene::TrueObject> cars = {
      {scene::makeState(25, 4, .7, .1, 4.1, 1.7, 1.5), "car"},
      {scene::makeState(34, -4, .7, 3., 4.3, 1.8, 1.5), "car"}};
  std::mt19937_64 random(3);
  const auto camera = std::make_shared<CameraModel>(scene::makeCamera());
  replay::RecordingWriter recording(file);
  recording.add("calibration", scene::calibrationOf(scene::makeCamera()), 0);
  recording.add("model", scene::makeModelInfo(), 1);
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    const RigidTransform T_WB = scene::driveTo(k, 0.4);
    semantic_filter::View view;
    view.camera = camera.get();
    view.T_WB = T_WB;
    std::vector<Detection> boxes;
    for (const auto& car : cars) {
      const auto box = scene::detect(car, view, semantic_filter::BoxParameters(), 1.0, 4.0, random);
      if (box) boxes.push_back(*box);
    }
    const std::uint64_t at = kStart + k * kPeriod;
    recording.add("odometry", scene::odometryAt(k, T_WB), at);
    recording.add("detections", scene::detectionsAt(k, boxes), at + kPeriod / 2);
    if (k % 5 == 4) recording.cut();
  }
  recording.finish();
}

/// Returns the pipeline's `objects` of the same recording, in order.
std::vector<Objects> runPipeline(const std::string& recording, const std::string& out) {
  PipelineOptions options;
  options.data = recording;
  options.out = out;
  options.odometry = options.detections = "recorded";
  options.quiet = true;
  Pipeline pipeline(options);
  std::vector<Objects> objects;
  pipeline.listen([&](const Objects& m) { objects.push_back(m); });
  pipeline.run([](const PipelineCounts&) {});
  return objects;
}

TEST(PlayProcess, GivesTheFilterServiceTheObjectsThatThePipelineHas) {
  const test::Folder place;
  recordStreet(place.file("run.mcap"));
  const auto expected = runPipeline(place.file("run.mcap"), place.file("out"));
  ASSERT_EQ(expected.size(), 20u);
  ASSERT_GE(expected.back().objects.size(), 2u);
  const bus::Domain domain(test::ownNetwork());
  test::Child filter({(test::programs() / "perdure-semantic-filter").string(), "--config",
                      (test::sources() / "config/semantic_filter.yaml").string(), "--set",
                      "restore.timeout_s=0.2"},
                     place.file("filter.log"));
  const bus::Participant participant(domain, "test");
  bus::Reader<Objects> reader(participant, bus::kTopic<Objects>);
  ASSERT_TRUE(test::eventually(20s, [&] { return reader.matched() == 1; })) << filter.log();
  test::Child player({perdure(), "play", place.file("run.mcap"), "--wait", "20"},
                     place.file("play.log"));
  std::vector<Objects> heard;
  EXPECT_TRUE(test::eventually(60s, [&] {
    reader.drain([&](const Objects& m) { heard.push_back(m); });
    return heard.size() == expected.size();
  })) << player.log();
  EXPECT_EQ(player.wait(10s), 0) << player.log();
  ASSERT_EQ(heard.size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) {
    ASSERT_TRUE(heard[k].stamp.sameFrame(expected[k].stamp)) << k;
    ASSERT_EQ(heard[k].objects.size(), expected[k].objects.size()) << k;
    for (std::size_t j = 0; j < expected[k].objects.size(); ++j) {
      const ObjectBelief &a = heard[k].objects[j], &b = expected[k].objects[j];
      ASSERT_EQ(a.id, b.id);
      ASSERT_NEAR(a.existence, b.existence, 1e-9);
      ASSERT_EQ(a.best().name, b.best().name);
      ASSERT_LT((a.best().mean - b.best().mean).cwiseAbs().maxCoeff(), 1e-6) << k << " " << a.id;
    }
  }
}

}  // namespace
}  // namespace perdure::tools
