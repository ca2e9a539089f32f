// Records ten minutes (PERDURE_RECORD_SECONDS) of all topics except images at full rate, then kills
// the recorder by kill -9.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <random>
#include <thread>

#include "common/bus/wait_loop.h"
#include "common/replay/recordings/recorded_messages.h"
#include "tests/process/support.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// A camera at 20 Hz with 120 landmarks, 10 boxes and 40 objects of three classes; IMU at 200 Hz.
class FullRate {
 public:
  FullRate()
      : domain_(test::ownNetwork()),
        participant_(domain_, "vehicle"),
        imu_(participant_, bus::kTopic<ImuSample>),
        speed_(participant_, bus::kTopic<SpeedSample>),
        odometry_(participant_, bus::kTopic<Odometry>),
        landmarks_(participant_, bus::kTopic<Landmarks>),
        detections_(participant_, bus::kTopic<Detections>),
        objects_(participant_, bus::kTopic<Objects>),
        loop_(participant_) {
    fill();
    loop_.every(5ms, [this] { publish(); });
    thread_ = std::thread([this] { loop_.run(); });
  }
  ~FullRate() { stop(); }
  bool heard() const { return imu_.matched() > 0 && objects_.matched() > 0; }
  std::uint64_t published() const { return published_; }
  /// The last refusal; valid after stop().
  const std::string& refusal() const { return refusal_; }
  void stop() {
    loop_.stop();
    if (thread_.joinable()) thread_.join();
  }

 private:
  /// Fills the messages with random numbers, which compress no better than real ones.
  void fill() {
    std::mt19937_64 random(1);
    const auto scatter = [&](auto& matrix) {
      for (double& x : matrix.reshaped()) x = std::normal_distribution<double>()(random);
    };
    points_.camera = boxes_.camera = "cam0";
    points_.landmarks.resize(120);
    for (Landmark& point : points_.landmarks) {
      scatter(point.p_W);
      scatter(point.cross_pose);
      point.covariance.setIdentity();
      for (auto& byte : point.descriptor) byte = static_cast<std::uint8_t>(random());
    }
    Detection box;
    box.box = {0, 0, 10, 10};
    box.activations = {0, 1, 2, 3};
    boxes_.detections.assign(10, box);
    working_set_.objects.resize(40);
    for (ObjectBelief& object : working_set_.objects) {
      object.id = random();
      for (const char* name : {"car", "van", "other"}) {
        object.classes.push_back({name, 1.0 / 3.0});
        scatter(object.classes.back().mean);
        scatter(object.classes.back().cross_pose);
      }
    }
  }
  template <class T>
  void write(bus::Writer<T>& writer, T& message) {
    if constexpr (requires { message.stamp; }) message.stamp.sequence = published_;
    const auto written = writer.write(message);
    if (!written) refusal_ = writer.topic() + ": " + written.error().detail;
  }
  void publish() {
    ImuSample sample;
    sample.sequence = published_;
    write(imu_, sample);
    if (published_ % 4 == 0) {
      SpeedSample speed;
      write(speed_, speed);
    }
    if (published_ % 10 == 0) {
      Odometry odometry;
      write(odometry_, odometry);
      write(landmarks_, points_);
      write(detections_, boxes_);
      write(objects_, working_set_);
    }
    ++published_;
  }

  bus::Domain domain_;
  bus::Participant participant_;
  bus::Writer<ImuSample> imu_;
  bus::Writer<SpeedSample> speed_;
  bus::Writer<Odometry> odometry_;
  bus::Writer<Landmarks> landmarks_;
  bus::Writer<Detections> detections_;
  bus::Writer<Objects> objects_;
  Landmarks points_;
  Detections boxes_;
  Objects working_set_;
  bus::WaitLoop loop_;
  std::atomic<std::uint64_t> published_ = 0;
  std::string refusal_;
  std::thread thread_;
};

/// Returns a process's CPU time so far, in seconds.
double processorSeconds(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  std::istringstream fields(text.substr(text.rfind(')') + 2));
  std::string word;
  for (int i = 3; i < 14; ++i) fields >> word;  // utime and stime are the 14th and the 15th field
  double user = 0, system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

TEST(LongFullRate, CostsATenthOfACoreAndKilledLosesLessThanASecond) {
  const char* given = std::getenv("PERDURE_RECORD_SECONDS");
  const double seconds = given != nullptr ? std::atof(given) : 600.0;
  const test::Folder place;
  (void)test::ownNetwork();
  FullRate vehicle;
  test::Child recorder({test::programs() / "perdure", "record", "--out", place.file("rec")},
                       place.file("record.log"));
  ASSERT_TRUE(test::eventually(20s, [&] { return vehicle.heard(); })) << recorder.log();
  const std::uint64_t first = vehicle.published();
  const double cpu = processorSeconds(recorder.pid());
  const auto start = std::chrono::steady_clock::now();
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  const double share =
      (processorSeconds(recorder.pid()) - cpu) /
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::uint64_t last = vehicle.published();
  recorder.signal(SIGKILL);
  recorder.wait(5s);
  vehicle.stop();
  EXPECT_EQ(vehicle.refusal(), "");
  EXPECT_LE(share, 0.10);

  replay::RecordedMessages recording(place.file("rec"));
  EXPECT_EQ(recording.reasons().of("unfinished"), 1u);
  recording.rewind([](const std::string& topic) { return topic == "imu"; });
  std::uint64_t samples = 0, newest = 0, gaps = 0;
  while (const auto message = recording.next()) {
    const std::uint64_t number = replay::valueOf<ImuSample>(*message)->sequence;
    if (samples++ > 0 && number != newest + 1) ++gaps;
    newest = number;
  }
  EXPECT_EQ(gaps, 0u);
  EXPECT_GT(newest + 200, last);
  EXPECT_GE(samples, last - first - 200);
  RecordProperty("core_percent", std::to_string(100 * share));
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(place.file("rec"))) bytes += entry.file_size();
  std::printf("%.2f %% of one core, %.1f MB a minute, %llu ms lost\n", 100 * share,
              60e-6 * static_cast<double>(bytes) / seconds,
              static_cast<unsigned long long>(5 * (last - newest)));
}

}  // namespace
}  // namespace perdure::tools
