#include "services/ros2/node.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/errors.h"

namespace perdure::ros2 {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kEpoch = 1'700'000'000'000'000'000, kMilli = 1'000'000;

class Ros2Node : public ::testing::Test {
 protected:
  void make(bool pair = false) {
    config_.cam0.image = "/left/image_raw";
    if (pair) config_.cam1.image = "/right/image_raw";
    config_.detections.topic = "/boxes";
    config_.detections.classes = {"Car"};
    node_ = std::make_unique<Node>(
        config_, Calibration(), 9,
        Outputs{.frame = [this](const Frame& m) { frames_.push_back(m); },
                .calibration = [this](const Calibration& m) { rig_ = m; },
                .detections = [this](const Detections& m) { found_.push_back(m); },
                .model = [this](const ModelInfo& m) { model_ = m; }});
    node_->start();
    for (std::size_t i = 0; i < (pair ? 2u : 1u); ++i) {
      ros::CameraInfo info;
      info.header.frame_id = "eye";
      info.width = 4, info.height = 2;
      info.distortion_model = "plumb_bob";
      info.d = {0, 0, 0, 0, 0}, info.k = {5, 0, 2, 0, 5, 1, 0, 0, 1};
      node_->onInfo(i, info, 0);
    }
  }
  ros::Image imageAt(std::int64_t ms, std::uint16_t value = 200, bool deep = false) {
    ros::Image m;
    m.header = {{static_cast<std::int32_t>((kEpoch + ms * kMilli) / 1'000'000'000),
                 static_cast<std::uint32_t>((kEpoch + ms * kMilli) % 1'000'000'000)},
                "eye"};
    m.width = 4, m.height = 2;
    m.encoding = deep ? "mono16" : "mono8";
    m.step = deep ? 8 : 4;
    auto data = std::make_shared<std::vector<std::uint8_t>>(m.step * 2);
    for (std::size_t i = 0; i < data->size(); ++i)
      (*data)[i] = static_cast<std::uint8_t>(deep && i % 2 == 1 ? value >> 8 : value);
    m.data = data;
    return m;
  }
  void see(std::int64_t ms, std::size_t camera = 0) {
    node_->onImage(camera, imageAt(ms), ms * kMilli);
  }
  ros::Detection2DArray boxesAt(std::int64_t ms) {
    ros::Detection2DArray m;
    m.header = imageAt(ms).header;
    return m;
  }

  Config config_;
  std::unique_ptr<Node> node_;
  std::vector<Frame> frames_;
  std::vector<Detections> found_;
  Calibration rig_;
  ModelInfo model_;
};

TEST_F(Ros2Node, GivesFramesOnceItsCalibrationIsKnown) {
  make();
  for (int i = 0; i < 10; ++i) see(i * 100);
  ASSERT_FALSE(frames_.empty());
  EXPECT_EQ(frames_.front().stamp.sequence, 0u) << "numbers of what went out, without a gap";
  EXPECT_EQ(frames_.back().stamp.sequence, frames_.size() - 1);
  EXPECT_EQ(frames_.back().stamp.captured_ns, 900 * kMilli);
  const ReasonCounts& counts = node_->troubles().counts();
  EXPECT_EQ(counts.of("cam0_clock_unknown"), 1u) << "one stamp alone is no clock";
  EXPECT_EQ(counts.of("cam0_before_calibration"), 9 - frames_.size());
  EXPECT_EQ(node_->health(900 * kMilli).first, HealthState::kOk);
  EXPECT_EQ(model_.classes, std::vector<std::string>{"car"});
}

TEST_F(Ros2Node, DetectionsThatComeBeforeTheirImageWaitForIt) {
  make();
  for (int i = 0; i < 10; ++i) see(i * 100);
  node_->onDetections(boxesAt(1000), 990 * kMilli);
  EXPECT_TRUE(found_.empty());
  see(1000);
  ASSERT_EQ(found_.size(), 1u);
  EXPECT_TRUE(found_[0].stamp.sameFrame(frames_.back().stamp));
  node_->onDetections(boxesAt(55), 1001 * kMilli);
  EXPECT_EQ(node_->troubles().counts().of("detections_of_no_frame"), 1u);
  EXPECT_THAT(node_->health(1001 * kMilli).second, HasSubstr("has to copy the stamp of its image"));
  for (int i = 0; i < 40; ++i) node_->onDetections(boxesAt(100'000 + i), 1002 * kMilli);
  EXPECT_EQ(node_->troubles().counts().of("detections_of_no_frame"), 25u)
      << "of those of the future sixteen wait";
}

TEST_F(Ros2Node, BothImagesOfAPairAreOneFrameWhicheverComesFirst) {
  make(true);
  for (int i = 0; i < 10; ++i) see(i * 100), see(i * 100 + 2, 1);
  frames_.clear();
  see(1000), see(1003, 1);
  see(1104, 1), see(1100);
  ASSERT_EQ(frames_.size(), 4u);
  for (const std::size_t i : {0u, 2u}) {
    EXPECT_EQ(frames_[i].camera, "cam0");
    EXPECT_EQ(frames_[i + 1].camera, "cam1");
    EXPECT_TRUE(frames_[i].stamp.sameFrame(frames_[i + 1].stamp));
    EXPECT_EQ(frames_[i].stamp.time, frames_[i + 1].stamp.time);
  }
  for (int i = 0; i < 6; ++i) see(1250 + i * 100, 1);
  EXPECT_EQ(node_->troubles().counts().of("cam1_unpaired"), 2u) << "four of six may wait";
}

/// Images with 12 of 16 bits: a dark start does not fix the number of bits.
TEST_F(Ros2Node, BrighterImagesOf16BitsRaiseTheBits) {
  make();
  for (int i = 0; i < 8; ++i) node_->onImage(0, imageAt(i * 100, 250, true), i * 100 * kMilli);
  EXPECT_EQ((*frames_.back().data)[0], 250);
  node_->onImage(0, imageAt(800, 0x0F00, true), 800 * kMilli);
  EXPECT_EQ((*frames_.back().data)[0], 0xF0);
  node_->onImage(0, imageAt(900, 0x0080, true), 900 * kMilli);
  EXPECT_EQ((*frames_.back().data)[0], 0x08) << "and dark ones are dark from then on";
}

TEST_F(Ros2Node, SaysForAWhileWhatWasWrongLast) {
  make();
  for (int i = 0; i < 10; ++i) see(i * 100);
  ros::Image odd = imageAt(1000);
  odd.encoding = "32FC1";
  node_->onImage(0, odd, 1000 * kMilli);
  EXPECT_EQ(node_->health(2000 * kMilli).first, HealthState::kDegraded);
  EXPECT_THAT(node_->health(2000 * kMilli).second, HasSubstr("images are `32FC1`"));
  EXPECT_EQ(node_->health(7000 * kMilli).first, HealthState::kOk);
}

TEST(Ros2Config, KnowsWhatATopicCarriesByItsName) {
  CameraInput camera{"cam0", "/camera/image_raw/compressed"};
  EXPECT_TRUE(camera.compressed());
  EXPECT_EQ(camera.infoTopic(), "/camera/camera_info");
  camera.image = "/camera/image_raw";
  EXPECT_FALSE(camera.compressed());
  EXPECT_EQ(camera.infoTopic(), "/camera/camera_info");
  camera.info = "/calibrated", camera.type = "compressed";
  EXPECT_TRUE(camera.compressed());
  EXPECT_EQ(camera.infoTopic(), "/calibrated");
}

TEST(Ros2Config, RefusesWhatCannotBe) {
  Config config;
  EXPECT_NO_THROW(verify(config));
  config.cam1.image = "/right/image_raw";
  EXPECT_THROW(verify(config), StartupError);
  config.cam0.image = "/left/image_raw";
  EXPECT_NO_THROW(verify(config));
  config.cam0.bits = 3;
  EXPECT_THROW(verify(config), StartupError);
}

}  // namespace
}  // namespace perdure::ros2
