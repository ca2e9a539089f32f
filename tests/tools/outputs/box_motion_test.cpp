#include "tools/outputs/box_motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "common/camera/camera_model.h"
#include "common/math/so3.h"
#include "tools/outputs/box_sizes.h"

namespace perdure::tools {
namespace {

using testing::HasSubstr;
using Frames = std::map<std::uint64_t, FrameGlance>;

CameraCalibration camera() {
  CameraCalibration camera;
  camera.width = 320, camera.height = 240;
  camera.fx = camera.fy = 190.0, camera.cx = 160.0, camera.cy = 120.0;
  camera.T_BC.q = Eigen::Matrix3d{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}};
  return camera;
}

/// A camera moves forwards and turns left and right among 40 objects. Boxes have errors of 4 % and
/// end at the border of the image.
Frames drive() {
  constexpr std::size_t kFrames = 240, kObjects = 40;
  constexpr double kRate_hz = 40.0;
  constexpr double kTurn = 0.4, kSize_m = 0.6;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> across(-6.0, 6.0), along(3.0, 25.0), up(-2.0, 1.0);
  std::normal_distribution<double> error(0.0, 0.04);
  std::vector<Eigen::Vector3d> objects;
  for (std::size_t i = 0; i < kObjects; ++i) {
    objects.emplace_back(along(random), across(random), up(random));
  }
  const CameraModel model(camera());
  Frames frames;
  for (std::size_t k = 0; k < kFrames; ++k) {
    FrameGlance& frame = frames[k];
    frame.has_objects = true;
    const double t = static_cast<double>(k) / kRate_hz;
    frame.T_WB = {expSo3(Eigen::Vector3d(0, 0.05 * std::sin(3.0 * t), kTurn * std::sin(2.0 * t))),
                  Eigen::Vector3d(1.5 * t, 0, 0)};
    for (const auto& p_W : objects) {
      const Eigen::Vector3d p_C = (frame.T_WB * model.T_BC()).inverse() * p_W;
      const auto at = p_C.z() > 1.0 ? model.project(p_C) : std::nullopt;
      if (!at || !model.inImage(*at)) continue;
      const double half = 0.5 * kSize_m * 190.0 / p_C.z();
      const auto side = [&](double centre, double sign, double most) {
        return std::clamp(centre + sign * half * (1.0 + error(random)), 0.0, most);
      };
      frame.detections.push_back({{side(at->x(), -1, 319), side(at->y(), -1, 239),
                                   side(at->x(), 1, 319), side(at->y(), 1, 239)},
                                  0.9});
    }
  }
  return frames;
}

std::string doubtAfter(const std::function<Box(const Box&)>& change) {
  Frames frames = drive();
  for (auto& [number, frame] : frames) {
    for (auto& detection : frame.detections) detection.box = change(detection.box);
  }
  const auto doubt = doubtOfBoxes(frames, camera());
  return doubt ? doubt->what + ": " + doubt->fix : "";
}

TEST(BoxMotion, SoundBoxesHaveNoDoubt) {
  EXPECT_EQ(doubtAfter([](const Box& b) { return b; }), "");
  EXPECT_EQ(doubtAfter([](const Box& b) {
              return Box{b.x1 + 1, b.y1 + 1, b.x2 + 1, b.y2 + 1};
            }),
            "")
      << "one-based pixels";
  EXPECT_FALSE(doubtOfBoxes({}, camera()));
}

TEST(BoxMotion, OtherAxesAreFound) {
  EXPECT_THAT(doubtAfter([](const Box& b) {
                return Box{320 - b.x2, b.y1, 320 - b.x1, b.y2};
              }),
              HasSubstr("mirrored left to right"));
  EXPECT_THAT(doubtAfter([](const Box& b) {
                return Box{b.x1, 240 - b.y2, b.x2, 240 - b.y1};
              }),
              HasSubstr("count y from the lower border"));
  EXPECT_THAT(doubtAfter([](const Box& b) {
                return Box{320 - b.x2, 240 - b.y2, 320 - b.x1, 240 - b.y1};
              }),
              HasSubstr("turned by 180°"));
  EXPECT_THAT(doubtAfter([](const Box& b) {
                return Box{b.y1, b.x1, b.y2, b.x2};
              }),
              HasSubstr("x and y of the boxes are exchanged"));
  EXPECT_THAT(doubtAfter([](const Box& b) {
                return Box{240 - b.y2, b.x1, 240 - b.y1, b.x2};
              }),
              HasSubstr("write x1 = y1, x2 = y2, y1 = 240 - x2, y2 = 240 - x1"));
  EXPECT_THAT(doubtAfter([](const Box& b) {
                return Box{b.y1, 320 - b.x2, b.y2, 320 - b.x1};
              }),
              HasSubstr("write x1 = 320 - y2, x2 = 320 - y1, y1 = x1, y2 = x2"));
}

TEST(BoxMotion, OtherSizesAreFoundWithTheFactor) {
  for (const double s : {0.5, 0.8, 2.0}) {
    EXPECT_THAT(doubtAfter([&](const Box& b) {
                  return Box{s * b.x1, s * b.y1, s * b.x2, s * b.y2};
                }),
                HasSubstr("multiply x1, x2 by " + std::string(s == 0.5   ? "2"
                                                              : s == 0.8 ? "1.25"
                                                                         : "0.5")));
  }
  EXPECT_THAT(doubtAfter([](const Box& b) {
                return Box{1.3 * b.x1, 1.3 * b.y1 + 52, 1.3 * b.x2, 1.3 * b.y2 + 52};
              }),
              HasSubstr("then subtract 40 from y1 and y2"));
  EXPECT_THAT(doubtAfter([](const Box& b) {
                return Box{b.x1 / 3.2, b.y1 / 2.4, b.x2 / 3.2, b.y2 / 2.4};
              }),
              HasSubstr("percent of the image?"));
}

TEST(BoxMotion, BoxesOfCroppedAndOfPaddedImagesAreFound) {
  EXPECT_THAT(doubtAfter([](const Box& b) {
                return Box{b.x1 - 30, b.y1 - 20, b.x2 - 30, b.y2 - 20};
              }),
              HasSubstr("add 31 to x1 and x2, 21 to y1 and y2"));
  EXPECT_THAT(doubtAfter([](const Box& b) {
                return Box{b.x1, b.y1 + 40, b.x2, b.y2 + 40};
              }),
              HasSubstr("add 1 to x1 and x2, -39 to y1 and y2"));
}

TEST(BoxMotion, NumbersOfADetectorThatSawEachSecondFrameAreFound) {
  const Frames sound = drive();
  Frames halved = sound;
  for (auto& [number, frame] : halved) frame.detections.clear();
  for (const auto& [number, frame] : sound) {
    if (number % 2 == 0) halved[number / 2].detections = frame.detections;
  }
  const auto doubt = doubtOfBoxes(halved, camera());
  ASSERT_TRUE(doubt);
  EXPECT_EQ(doubt->what, "boxes have wrong frame numbers");
  EXPECT_THAT(doubt->fix, HasSubstr("multiply the numbers by 2"));
}

/// The fix for boxes whose frame numbers were changed by `change`.
std::string fixAfter(const std::function<std::int64_t(std::int64_t)>& change) {
  const Frames sound = drive();
  Frames changed = sound;
  for (auto& [number, frame] : changed) frame.detections.clear();
  for (const auto& [number, frame] : sound) {
    const std::int64_t other = change(static_cast<std::int64_t>(number));
    const auto found = changed.find(static_cast<std::uint64_t>(other));
    if (found != changed.end()) found->second.detections = frame.detections;
  }
  const auto doubt = doubtOfBoxes(changed, camera());
  return doubt ? doubt->what + ": " + doubt->fix : "";
}

TEST(BoxMotion, ShiftedAndReversedNumbersAreFound) {
  EXPECT_THAT(fixAfter([](std::int64_t k) { return k + 10; }),
              HasSubstr("subtract about 10 from the numbers"));
  EXPECT_THAT(fixAfter([](std::int64_t k) { return k - 5; }),
              HasSubstr("add about 5 to the numbers"));
  EXPECT_THAT(fixAfter([](std::int64_t k) { return 239 - k; }), HasSubstr("write 239 - number"));
}

TEST(BoxMotion, AShiftIsEstimatedWithoutBordersThatShowIt) {
  EXPECT_THAT(doubtAfter([](const Box& b) {
                return Box{b.x1 + 16, b.y1, std::min(319.0, b.x2 + 16), b.y2};
              }),
              testing::AllOf(HasSubstr("boxes are shifted"), HasSubstr("add -1")));
}

TEST(BoxMotion, BoxesOfAnotherDriveContradictThePoses) {
  Frames frames = drive();
  for (auto& [number, frame] : frames) {
    const double t = static_cast<double>(number) / 40.0;
    frame.T_WB = {expSo3(Eigen::Vector3d(0, 0.1 * std::cos(t), 0.5 * std::sin(3.1 * t + 1.0))),
                  Eigen::Vector3d(0, 0.7 * t, 0)};
  }
  const auto doubt = doubtOfBoxes(frames, camera());
  ASSERT_TRUE(doubt);
  EXPECT_EQ(doubt->what, "boxes contradict the poses");
}

TEST(BoxHeights, AreThoseOfTheirClasses) {
  const auto doubtAt = [](double excess) {
    const auto doubt = doubtOfHeights(std::vector<EstimatedHeight>(20, {excess, 0.05, 0.18}));
    return doubt ? doubt->what : "";
  };
  EXPECT_EQ(doubtAt(0.1), "");
  EXPECT_EQ(doubtAt(-0.1), "");
  EXPECT_EQ(doubtAt(0.3), "objects are too large");
  EXPECT_EQ(doubtAt(-0.4), "objects are too small");
  EXPECT_FALSE(doubtOfHeights(std::vector<EstimatedHeight>(9, {0.5, 0.05, 0.18}))) << "too few";
  EXPECT_FALSE(doubtOfHeights(std::vector<EstimatedHeight>(20, {0.1, 0.17, 0.18}))) << "the prior";
}

TEST(BoxMotion, AChangeInMidDriveIsNamedWithItsFrame) {
  Frames frames = drive();
  for (auto& [number, frame] : frames) {
    if (number < 120) continue;
    for (auto& [box, probability, best] : frame.detections) {
      box = {320 - box.x2, box.y1, 320 - box.x1, box.y2};
    }
  }
  const auto doubt = doubtOfBoxes(frames, camera());
  ASSERT_TRUE(doubt);
  EXPECT_THAT(doubt->what, HasSubstr("mirrored left to right from about frame 1"));
}

TEST(BoxMotion, DoubledNumbersAreFound) {
  EXPECT_THAT(fixAfter([](std::int64_t k) { return 2 * k; }), HasSubstr("divide by 2"));
}

TEST(BoxMotion, FramesInDisorderAreFound) {
  EXPECT_THAT(fixAfter([](std::int64_t k) { return k * 77 % 240; }),
              HasSubstr("boxes do not continue from frame to frame"));
}

TEST(BoxMotion, ClassesThatChangeAtEachFrameAreFound) {
  Frames frames = drive();
  for (auto& [number, frame] : frames) {
    for (auto& one : frame.detections) one.best_class = 1 + number % 3;
  }
  const auto doubt = doubtOfBoxes(frames, camera());
  ASSERT_TRUE(doubt);
  EXPECT_THAT(doubt->what, HasSubstr("classes of the boxes change"));
}

}  // namespace
}  // namespace perdure::tools
