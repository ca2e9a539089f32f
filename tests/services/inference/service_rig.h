// Runs one real inference process, sends frames to it, and receives its detections.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>

#include "tests/process/support.h"
#include "tests/services/run_until.h"

namespace perdure::inference::testing {

class ServiceRig {
 public:
  ServiceRig(const bus::Options& options, const std::vector<std::string>& arguments)
      : domain_(options), participant_(domain_, "test") {
    std::vector<std::string> command = {(test::programs() / "perdure-inference").string()};
    command.insert(command.end(), arguments.begin(), arguments.end());
    service = std::make_unique<test::Child>(command, folder.file("inference.log"));
    loop_.on(detections_, [this](const Detections& d) { answers.push_back(d); });
    loop_.on(models_, [this](const ModelInfo& m) { models[m.hash] = m.name; });
    loop_.on(health_, [this](const Health& h) {
      if (h.process == "inference") health = h;
    });
    EXPECT_TRUE(until([&] {
      return frames_.matched() == 1 && detections_.matched() == 1 && odometry_.matched() == 1 &&
             calibration_.matched() == 1;
    })) << service->log();
  }

  void send(std::uint32_t width = 640, std::uint32_t height = 480) {
    Frame frame;
    frame.stamp.source = 77;
    frame.stamp.sequence = sent++;
    frame.stamp.time = fromNanoseconds(static_cast<std::int64_t>(sent) * 100'000'000);
    frame.stamp.captured_ns = 1'000'000 + static_cast<std::int64_t>(sent);
    frame.camera = "cam0";
    frame.width = width;
    frame.height = height;
    frame.data = std::make_shared<const std::vector<std::uint8_t>>(
        std::size_t{width} * height, static_cast<std::uint8_t>(40 + 10 * (sent % 20)));
    ASSERT_TRUE(frames_.write(frame));
  }
  /// Sends the calibration of a level camera that is mounted upside down.
  void sendUpsideDown() {
    perdure::Calibration rig;
    CameraCalibration& camera = rig.cameras.emplace_back();
    camera.name = "cam0";
    camera.width = 640, camera.height = 480;
    camera.fx = camera.fy = 400.0;
    Odometry odometry;
    odometry.state = OdometryState::kTracking;
    odometry.up_W = Eigen::Vector3d::UnitY();
    ASSERT_TRUE(calibration_.write(rig) && odometry_.write(odometry));
  }
  bool until(const std::function<bool()>& so) { return test::runUntil(loop_, so); }
  bool answered(std::uint64_t sequence) {
    return until([&] { return !answers.empty() && answers.back().stamp.sequence == sequence; });
  }

  test::Folder folder;
  std::unique_ptr<test::Child> service;
  std::vector<Detections> answers;
  std::map<std::uint64_t, std::string> models;  ///< names by hash
  Health health;
  std::uint64_t sent = 0;

 private:
  bus::Domain domain_;
  bus::Participant participant_;
  bus::Writer<Frame> frames_{participant_, bus::frameTopic("cam0")};
  bus::Writer<perdure::Calibration> calibration_{participant_, bus::kTopic<perdure::Calibration>};
  bus::Writer<Odometry> odometry_{participant_, bus::kTopic<Odometry>};
  bus::Reader<ModelInfo> models_{participant_, bus::kTopic<ModelInfo>};
  bus::Reader<Detections> detections_{participant_, bus::kTopic<Detections>};
  bus::Reader<Health> health_{participant_, bus::kTopic<Health>};
  bus::WaitLoop loop_{participant_};
};

}  // namespace perdure::inference::testing
