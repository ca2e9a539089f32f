// `perdure record` and `perdure play` as they are run, against topics that this test publishes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <thread>

#include "common/bus/wait_loop.h"
#include "common/replay/recordings/recorded_messages.h"
#include "common/replay/recordings/recording_writer.h"
#include "common/types/map.h"
#include "tests/common/replay/ros_twin.h"
#include "tests/process/support.h"
#include "tests/services/gateway/objects.h"
#include "tests/services/semantic_filter/scene.h"
#include "tools/pipeline/pipeline.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
namespace scene = semantic_filter::testing;
using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;

std::string perdure() { return (test::programs() / "perdure").string(); }

std::vector<fs::path> filesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::exists(folder)) return files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// What a file has: "finished", or why not.
std::string stateOf(const fs::path& file) {
  const auto reader = replay::mcap::Reader::open(file);
  return !reader ? reader.error().code : reader->finished() ? "finished" : "unfinished";
}

/// Inertial samples at 200 Hz, odometry at 20 Hz and a calibration, as long as it lives.
class Vehicle {
 public:
  Vehicle()
      : domain_(test::ownNetwork()),
        participant_(domain_, "vehicle"),
        imu_(participant_, bus::topics::kImu),
        odometry_(participant_, bus::topics::kOdometry),
        calibration_(participant_, bus::topics::kCalibration),
        health_(participant_, bus::topics::kHealth),
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
  bus::Writer<Calibration> calibration_;
  bus::Writer<Health> health_;
  bus::WaitLoop loop_;
  std::atomic<std::uint64_t> published_ = 0;
  std::atomic<HealthState> state_ = HealthState::kOk;
  std::thread thread_;
};

/// Sequence numbers of the inertial samples; they are without a gap, or -1 is among them.
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
  EXPECT_GT(last, static_cast<std::int64_t>(before) - 200);  // of a second
  EXPECT_GT(last - first, 150);
  test::Child next({perdure(), "record", "--out", out, "--seconds", "0.3"}, place.file("next.log"));
  EXPECT_EQ(next.wait(20s), 0);
  EXPECT_THAT(next.log(), HasSubstr("had been cut off and is whole again"));
  EXPECT_EQ(stateOf(files[0]), "finished");
  EXPECT_EQ(filesIn(out).size(), 2u);
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
            static_cast<std::int64_t>(start));  // it was there before the box reaches back to
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

/// What map_store writes itself is left to it; events of the filter are played.
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

TEST(RepairProcess, AFileWithoutAWholeChunkStaysAsItIs) {
  const test::Folder place;
  const fs::path file = place.file("run.mcap");
  replay::RecordingWriter recording(file);
  for (std::uint64_t i = 0; i < 50; ++i) recording.add("imu", ImuSample{}, 1000 * i);
  recording.finish();
  const auto whole = replay::mcap::Reader::open(file);
  ASSERT_TRUE(whole && whole->chunks().size() == 1);
  const auto half = whole->chunks().front().offset + whole->chunks().front().length / 2;
  fs::resize_file(file, half);
  test::Child repair({perdure(), "record", "repair", file}, place.file("repair.log"));
  EXPECT_EQ(repair.wait(20s), 69);
  EXPECT_THAT(repair.log(), HasSubstr("holds no whole chunk"));
  EXPECT_EQ(fs::file_size(file), half);
}

/// Four chunks of ten samples each; where each of them begins.
std::vector<std::uint64_t> recordChunks(const fs::path& file) {
  replay::RecordingWriter recording(file);
  for (std::uint64_t i = 0; i < 40; ++i) {
    recording.add("imu", ImuSample{}, 1000 * i);
    if (i % 10 == 9) recording.cut();
  }
  recording.finish();
  std::vector<std::uint64_t> offsets;
  const auto reader = replay::mcap::Reader::open(file);
  for (const auto& chunk : reader->chunks()) offsets.push_back(chunk.offset);
  return offsets;
}

void setByte(const fs::path& file, std::uint64_t at, char byte) {
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(static_cast<std::streamoff>(at));
  stream.put(byte);
}

struct Said {
  int status = 0;
  std::string text;
};

Said record(const std::string& what, const fs::path& file, const char* flag = nullptr) {
  const test::Folder logs;
  std::vector<std::string> words{perdure(), "record", what, file};
  if (flag != nullptr) words.emplace_back(flag);
  test::Child child(words, logs.file("log"));
  const int status = child.wait(20s);
  return {status, child.log()};
}

TEST(RepairProcess, DamagedChunksAreCountedAndTheFileIsNotCalledWhole) {
  const test::Folder place;
  const fs::path file = place.file("run.mcap");
  const auto offsets = recordChunks(file);
  ASSERT_EQ(offsets.size(), 4u);
  constexpr std::uint64_t kCrcAt = 9 + 24, kLengthAt = 8;
  setByte(file, offsets[1] + kCrcAt, 'x');
  setByte(file, offsets[2] + kLengthAt, 'x');  // 2^62 bytes
  const std::string before = test::contentsOf(file);
  const Said info = record("info", file, "--check"), repair = record("repair", file);
  EXPECT_EQ(info.status, 0);
  const std::string why = "2 of 4 chunks cannot be read; the first, at byte " +
                          std::to_string(offsets[1]) + ": a chunk with a wrong checksum";
  EXPECT_THAT(info.text, HasSubstr(why));
  EXPECT_THAT(info.text, testing::ContainsRegex("imu +20 "));
  EXPECT_EQ(repair.status, 65);
  EXPECT_THAT(repair.text, HasSubstr(why));
  EXPECT_THAT(repair.text, HasSubstr("20 messages of it are read"));
  EXPECT_EQ(test::contentsOf(file), before);
}

TEST(RepairProcess, AFileThatIsCutStaysBesideItAsItWas) {
  const test::Folder place;
  const fs::path file = place.file("run.mcap"), copy = place.file("run.mcap.before-repair");
  fs::resize_file(file, (recordChunks(file), fs::file_size(file) / 2));
  const std::string before = test::contentsOf(file);
  const Said first = record("repair", file);
  EXPECT_EQ(first.status, 0);
  EXPECT_THAT(first.text, HasSubstr("the file as it was is " + copy.string()));
  EXPECT_EQ(test::contentsOf(copy), before);
  EXPECT_EQ(stateOf(file), "finished");
  fs::copy_file(copy, file, fs::copy_options::overwrite_existing);
  const Said second = record("repair", file);
  EXPECT_EQ(second.status, 69);
  EXPECT_THAT(second.text, HasSubstr("is there already"));
  EXPECT_EQ(test::contentsOf(file), before);
}

TEST(RepairProcess, WithoutRoomForTheCopyNothingIsTouched) {
  const test::Folder place;
  fs::create_directories(place.file("small"));
  const fs::path file = place.file("run.mcap"), there = place.file("small/run.mcap");
  recordChunks(file);
  fs::resize_file(file, fs::file_size(file) - 1);
  const std::string before = test::contentsOf(file);
  const std::string script = "mount -t tmpfs -o size=8k own " + place.file("small") + " && cp " +
                             file.string() + " " + there.string() +
                             " && dd if=/dev/zero of=" + place.file("small/ballast") +
                             " bs=1k 2> /dev/null; " + perdure() + " record repair " +
                             there.string() + "; echo status $?; ls " + place.file("small") +
                             "; cmp " + there.string() + " " + file.string() + " && echo untouched";
  test::Child child({"unshare", "-m", "sh", "-c", script}, place.file("log"));
  child.wait(20s);
  if (child.log().find("status") == std::string::npos) GTEST_SKIP() << "no right to mount a disk";
  EXPECT_THAT(child.log(), HasSubstr("status 74\nballast\nrun.mcap\nuntouched"));
}

TEST(InfoProcess, OfASqliteRecordingOfRosIsTheSameTable) {
  const test::Twin twin = test::twinOf("record_info");
  const Said said = record("info", twin.file);
  EXPECT_EQ(said.status, 0);
  EXPECT_THAT(said.text, HasSubstr("a recording of ROS"));
  EXPECT_THAT(said.text,
              testing::ContainsRegex("/cam0/image_raw +5 +[0-9.]+ Hz +sensor_msgs/Imag"));
}

TEST(ExportProcess, OfARecordingOfOthersNoFileIsMade) {
  const test::Folder place;
  const fs::path file = place.file("run.mcap"), to = place.file("new.mcap");
  replay::RecordingWriter recording(file);
  recording.addBytes({"camera", "sensor_msgs/msg/Image", ""}, {}, 1000);
  recording.finish();
  for (const bool ros2 : {false, true}) {
    std::vector<std::string> command{perdure(), "record", "export", file, to};
    if (ros2) command.push_back("--ros2");
    test::Child child(command, place.file("log"));
    EXPECT_EQ(child.wait(20s), 65) << child.log();
    EXPECT_THAT(child.log(), HasSubstr("holds no message that can be exported"));
    EXPECT_FALSE(fs::exists(to));
  }
}

TEST(ExportProcess, OnAFullDiskNoFileIsLeft) {
  const test::Folder place;
  fs::create_directories(place.file("small"));
  recordChunks(place.file("run.mcap"));
  const std::string small = place.file("small");
  const std::string script = "mount -t tmpfs -o size=8k own " + small +
                             " && dd if=/dev/zero of=" + small + "/ballast bs=1k 2> /dev/null; " +
                             perdure() + " record export " + place.file("run.mcap") + " " + small +
                             "/new.mcap; echo status $?; ls " + small;
  test::Child child({"unshare", "-m", "sh", "-c", script}, place.file("log"));
  child.wait(20s);
  if (child.log().find("status") == std::string::npos) GTEST_SKIP() << "no right to mount a disk";
  EXPECT_THAT(child.log(), HasSubstr("status 74\nballast\n"));
  EXPECT_THAT(child.log(), Not(HasSubstr("new.mcap\n")));
}

TEST(RepairProcess, AnEmptyFileIsToldToBeEmpty) {
  const test::Folder place;
  const fs::path file = place.file("run.mcap");
  std::ofstream(file).flush();
  for (const char* what : {"info", "repair"}) {
    const Said said = record(what, file);
    EXPECT_EQ(said.status, 69) << what;
    EXPECT_THAT(said.text, HasSubstr("is empty")) << what;
  }
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

/// What vio and inference would say along a street with two cars: odometry, and its detections
/// half a period later. Frames are .1 s apart for the filter, and .2 s on the wire.
void recordStreet(const std::string& file) {
  constexpr std::uint64_t kPeriod = 200'000'000, kFrames = 20;
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
    recording.add("odometry", scene::odometryAt(k, T_WB), (k + 1) * kPeriod);
    recording.add("detections", scene::detectionsAt(k, boxes), (k + 1) * kPeriod + kPeriod / 2);
    if (k % 5 == 4) recording.cut();
  }
  recording.finish();
}

/// The pipeline's `objects` of the same recording, in order.
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

std::vector<Objects> objectsIn(const std::string& recording) {
  replay::RecordedMessages messages(recording);
  messages.rewind([](const std::string& topic) { return topic == "objects"; });
  std::vector<Objects> objects;
  while (const auto message = messages.next()) {
    objects.push_back(*replay::valueOf<Objects>(*message));
  }
  return objects;
}

TEST(PlayProcess, GivesTheFilterServiceTheObjectsThatThePipelineHas) {
  const test::Folder place;
  recordStreet(place.file("run.mcap"));
  const auto expected = runPipeline(place.file("run.mcap"), place.file("out"));
  ASSERT_EQ(expected.size(), 20u);
  ASSERT_GE(expected.back().objects.size(), 2u);
  (void)test::ownNetwork();
  test::Child filter({(test::programs() / "perdure-semantic-filter").string(), "--config",
                      (test::sources() / "config/semantic_filter.yaml").string(), "--set",
                      "restore.timeout_s=0.2"},
                     place.file("filter.log"));
  test::Child recorder({perdure(), "record", "--out", place.file("rec"), "--topics", "objects"},
                       place.file("record.log"));
  test::Child player({perdure(), "play", place.file("run.mcap"), "--wait", "20"},
                     place.file("play.log"));
  ASSERT_EQ(player.wait(60s), 0) << player.log();
  std::this_thread::sleep_for(300ms);
  recorder.signal(SIGTERM);
  ASSERT_EQ(recorder.wait(5s), 0);
  const auto heard = objectsIn(place.file("rec"));
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
