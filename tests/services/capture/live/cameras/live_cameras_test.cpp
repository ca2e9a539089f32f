// Tests LiveCameras with two simulated cameras in their threads, in simulated time.
#include "services/capture/live/cameras/live_cameras.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "tests/services/capture/live/cameras/fake_camera.h"
#include "tests/services/capture/live/times.h"

namespace perdure::capture {
namespace {

using namespace std::chrono_literals;
using ::testing::_;
using ::testing::ElementsAre;
using testing::FakeCamera;
using ::testing::HasSubstr;
using ::testing::Pair;

class TwoCameras : public ::testing::Test {
 protected:
  using Numbers = std::vector<std::pair<std::string, std::uint64_t>>;

  void SetUp() override {
    const auto end = std::chrono::steady_clock::now() + 20s;
    while (left_.openings() + right_.openings() < 2) {
      ASSERT_LT(std::chrono::steady_clock::now(), end);
      std::this_thread::sleep_for(2ms);
    }
    (void)moment();
  }
  /// Advances to the next moment, lets the selected cameras take an image, and returns the
  /// published images.
  Numbers moment(bool left = true, bool right = true) {
    const std::int64_t t = kSecond + 50 * kMs * ++moment_;
    if (left) left_.shoot(moment_, t);
    if (right) right_.shoot(moment_, t + kMs);
    std::vector<CameraImage> come;
    for (int i = 0; i < left + right; ++i) {
      auto image = given_.popWithin(20s);
      if (!image) return {{"nothing came", 0}};
      come.push_back(*std::move(image));
    }
    std::sort(come.begin(), come.end(),
              [](const auto& a, const auto& b) { return a.frame.camera < b.frame.camera; });
    Numbers out;
    const auto note = [&](const std::vector<CameraImage>& images) {
      for (const auto& image : images) out.emplace_back(image.frame.camera, image.number);
    };
    for (auto& image : come) note(cameras_.pair(std::move(image), t + 2 * kMs));
    note(cameras_.due(t + 30 * kMs));
    return out;
  }
  /// Publishes a pair at the next moment and returns its common number.
  std::uint64_t pairedNumber() {
    const Numbers out = moment();
    EXPECT_THAT(out, ElementsAre(Pair("cam0", _), Pair("cam1", _)));
    if (out.size() != 2) return 0;
    EXPECT_EQ(out[0].second, out[1].second);
    return out[0].second;
  }
  /// Takes images with the selected cameras until `so` returns true. Without images, the remaining
  /// camera would count as silent.
  void waitWith(bool left, bool right, const std::function<bool()>& so) {
    const auto end = std::chrono::steady_clock::now() + 20s;
    while (!so()) {
      ASSERT_LT(std::chrono::steady_clock::now(), end);
      const Numbers out = moment(left, right);
      ASSERT_EQ(out.size(), left ? 1u : 0u);
      std::this_thread::sleep_for(2ms);
    }
  }
  std::uint64_t counted(const std::string& reason) {
    ReasonCounts counts;
    cameras_.report(counts);
    return counts.of(reason);
  }

  std::uint32_t moment_ = 0;
  const FakeCamera left_{"left"}, right_{"right"};
  BoundedQueue<CameraImage> given_{64, Overflow::kBlock};
  LiveCameras cameras_{{left_.opener(), right_.opener()}, 20.0, [this](CameraImage image) {
                         given_.push(std::move(image));
                       }};
};

TEST_F(TwoCameras, GiveOneMomentOneNumber) {
  for (std::uint64_t n = 1; n < 20; ++n) EXPECT_EQ(pairedNumber(), n);
  EXPECT_EQ(cameras_.problem(), "");
  EXPECT_EQ(cameras_.name(), "cam0 left; cam1 right");
}

TEST_F(TwoCameras, CountFramesThatADriverLostByCamera) {
  EXPECT_EQ(pairedNumber(), 1u);
  moment_ += 2;
  EXPECT_THAT(moment(true, false), ElementsAre(Pair("cam0", 4u)));
  EXPECT_EQ(pairedNumber(), 5u);
  EXPECT_EQ(counted("camera_frame_lost_cam0"), 2u);
  EXPECT_EQ(counted("camera_frame_lost_cam1"), 3u);
  EXPECT_EQ(counted("camera_frame_lost"), 0u);
}

TEST_F(TwoCameras, WithCam1UnpluggedCam0GoesOnAndBothAreBackWhenItIs) {
  (void)pairedNumber();
  right_.unplug();
  waitWith(true, false, [&] { return counted("camera_lost_cam1") == 1; });
  EXPECT_THAT(cameras_.problem(), HasSubstr("cam1: "));
  EXPECT_EQ(cameras_.name(), "cam0 left");
  waitWith(true, false, [&] { return counted("camera_absent_cam1") >= 1; });
  EXPECT_EQ(cameras_.problem(), "cam1: right is not plugged in.");
  EXPECT_EQ(counted("camera_absent_cam0") + counted("camera_lost_cam0"), 0u);
  right_.plug();
  waitWith(true, false, [&] { return right_.openings() == 2; });
  (void)moment();
  std::uint64_t number = pairedNumber();
  for (int i = 0; i < 10; ++i) EXPECT_EQ(pairedNumber(), ++number);
  waitWith(true, false, [&] { return cameras_.problem().empty(); });
  EXPECT_GT(counted("stereo_unpaired_cam0"), 1u);
  EXPECT_EQ(counted("stereo_unpaired_cam1"), 2u)
      << "of the first moment of each opening, which nobody waited for";
}

TEST_F(TwoCameras, WithCam0UnpluggedThoseOfCam1AreDroppedAndItsNumbersGoOn) {
  const std::uint64_t last = pairedNumber();
  left_.unplug();
  waitWith(false, true, [&] { return counted("camera_lost_cam0") == 1; });
  EXPECT_THAT(cameras_.problem(), HasSubstr("cam0: "));
  left_.plug();
  waitWith(false, true, [&] { return left_.openings() == 2; });
  EXPECT_EQ(pairedNumber(), last + 1);
  EXPECT_GT(counted("stereo_unpaired_cam1"), 1u);
}

TEST_F(TwoCameras, OneThatStepsAsideIsOpenedAgainAndWasNotLost) {
  const std::uint64_t last = pairedNumber();
  left_.askAside();
  waitWith(false, true, [&] { return left_.openings() == 2; });
  EXPECT_EQ(counted("camera_reopened_cam0"), 1u);
  EXPECT_EQ(counted("camera_lost_cam0") + counted("camera_silent_cam0"), 0u);
  EXPECT_EQ(pairedNumber(), last + 1);
  EXPECT_EQ(cameras_.problem(), "");
}

TEST(OneCamera, IsNotPairedAndItsCountsHaveNoName) {
  const FakeCamera camera("only");
  BoundedQueue<CameraImage> given(8, Overflow::kBlock);
  LiveCameras cameras({camera.opener()}, 20.0,
                      [&](CameraImage image) { given.push(std::move(image)); });
  const auto end = std::chrono::steady_clock::now() + 20s;
  while (camera.openings() == 0 && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(2ms);
  camera.shoot(0, kSecond);
  auto image = given.popWithin(20s);
  ASSERT_TRUE(image);
  EXPECT_THAT(cameras.pair(*std::move(image), kSecond), ::testing::SizeIs(1));
  ReasonCounts counts;
  cameras.report(counts);
  EXPECT_TRUE(counts.all().empty());
  camera.unplug();
  while (counts.of("camera_lost") == 0 && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(2ms);
    counts = {};
    cameras.report(counts);
  }
  EXPECT_EQ(counts.of("camera_lost"), 1u);
  EXPECT_THAT(cameras.problem(), HasSubstr("unplugged"));
}

}  // namespace
}  // namespace perdure::capture
