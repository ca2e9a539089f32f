#include <gtest/gtest.h>

#include <opencv2/videoio.hpp>

#include "common/vision/image.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tests/tools/outputs/pixels.h"
#include "tests/tools/outputs/scene.h"
#include "tools/outputs/pictures/overlay_picture.h"
#include "tools/outputs/pictures/overlay_video.h"

namespace perdure::tools {
namespace {

const Eigen::Vector3d kAhead(12.0, 1.0, 0.0);
const Colour kWhite(255, 255, 255);

Colour onImage(const std::string& class_name) {
  return mixed(classColour(class_name), kWhite, 0.35);
}

cv::Mat black() { return cv::Mat::zeros(480, 640, CV_8UC3); }

/// Draws one frame over a black image and returns the image part of the picture.
cv::Mat drawn(const FrameGlance& frame, const CameraCalibration& camera = aheadCamera()) {
  const OverlayPicture picture(camera, {});
  return picture.draw(black(), frame, {}, {})(picture.imageArea()).clone();
}

cv::Point2d pixelOf(const CameraCalibration& camera, const Eigen::Vector3d& p_W) {
  const auto pixel = CameraModel(camera).project(camera.T_BC.inverse() * p_W);
  return {pixel->x(), pixel->y()};
}

/// Coverage of the lower edge of the object's rear, which is nearest to the camera and crosses no
/// other edge.
double coverageOfRearEdge(Visibility visibility) {
  const ObjectGlance car = objectAt(1, kAhead, visibility);
  const auto corners = cornersOf(car);
  return coverage(drawn(frameOf(0, {car})), pixelOf(aheadCamera(), corners[0]),
                  pixelOf(aheadCamera(), corners[2]), onImage("car"));
}

TEST(Overlay, AnObjectInSightHasUnbrokenLinesAndAHiddenOneHasGaps) {
  EXPECT_EQ(coverageOfRearEdge(Visibility::kVisible), 1.0);
  EXPECT_EQ(coverageOfRearEdge(Visibility::kPartial), 1.0);
  const double hidden = coverageOfRearEdge(Visibility::kOccluded);
  EXPECT_GT(hidden, 0.4);
  EXPECT_LT(hidden, 0.95);
}

TEST(Overlay, AHiddenObjectIsSeenOverTheOneThatHidesIt) {
  ObjectGlance near = objectAt(1, {8.0, 0.0, 0.0}, Visibility::kVisible, "van");
  ObjectGlance behind = objectAt(2, {12.65, 0.0, 0.0}, Visibility::kOccluded);
  near.size = {0.5, 1.0, 1.0};
  // this object has the same size in the image, so that the lines coincide
  behind.size = {0.5, 1.6, 1.6};
  const auto corners = cornersOf(behind);
  const cv::Mat image = drawn(frameOf(0, {behind, near}));
  EXPECT_GT(coverage(image, pixelOf(aheadCamera(), corners[0]), pixelOf(aheadCamera(), corners[2]),
                     onImage("car")),
            0.4);
}

TEST(Overlay, WhatIsOutOfViewBehindOrUnconfirmedLeavesTheImageAlone) {
  ObjectGlance guess = objectAt(1, kAhead);
  guess.confirmed = false;
  EXPECT_EQ(cv::countNonZero(drawn(frameOf(0, {guess})).reshape(1)), 0);
  for (const auto& [p, v] : {std::pair{kAhead, Visibility::kOutOfView},
                             {Eigen::Vector3d(-12, 1, 0), Visibility::kBehind},
                             {Eigen::Vector3d(-12, 1, 0), Visibility::kVisible}}) {
    EXPECT_EQ(cv::countNonZero(drawn(frameOf(0, {objectAt(1, p, v)})).reshape(1)), 0);
  }
}

TEST(Overlay, AnObjectBesideTheCameraIsDrawnAsFarAsItIsInFront) {
  const cv::Mat image = drawn(frameOf(0, {objectAt(1, {2.0, 2.0, 0.0})}));
  EXPECT_GT(cv::countNonZero(image.colRange(0, 200).reshape(1)), 100);
  EXPECT_EQ(cv::countNonZero(image.colRange(500, 640).rowRange(40, 480).reshape(1)), 0);
}

TEST(Overlay, EdgesBendAsTheLensBendsThem) {
  CameraCalibration camera = aheadCamera();
  camera.distortion = DistortionModel::kRadialTangential;
  camera.distortion_coefficients = {-0.35, 0.1, 0.0, 0.0};
  ObjectGlance wide = objectAt(1, {6.0, 0.0, 1.6});
  wide.size = {0.02, 5.0, 1.0};
  const auto corners = cornersOf(wide);
  const Eigen::Vector3d left = corners[6], right = corners[4];  // the rear's upper edge
  const cv::Mat image = drawn(frameOf(0, {wide}), camera);
  const cv::Point2d middle = pixelOf(camera, (left + right) / 2);
  const cv::Point2d straight = (pixelOf(camera, left) + pixelOf(camera, right)) / 2;
  ASSERT_GT(std::abs(middle.y - straight.y), 8.0) << "the lens of this test bends too little";
  EXPECT_TRUE(hasColour(image, middle, onImage("car")));
  EXPECT_FALSE(hasColour(image, straight, onImage("car"), 2));
}

TEST(Overlay, TheDetectorsBoxesAreGreyAndFaintOnesAreLeftOut) {
  FrameGlance frame = frameOf(0, {});
  frame.detections = {{{100, 100, 200, 180}, 0.9}, {{300, 300, 400, 380}, 0.05}};
  const cv::Mat image = drawn(frame);
  const Colour grey(165, 165, 165);
  EXPECT_EQ(coverage(image, {100, 100}, {200, 100}, grey), 1.0);
  EXPECT_EQ(coverage(image, {300, 300}, {400, 300}, grey), 0.0);
}

TEST(Overlay, ManyLabelsAtTheBorderStayInTheImageAndOffEachOther) {
  const cv::Rect image(0, 0, 640, 480);
  std::vector<cv::Rect> taken;
  for (int i = 0; i < 60; ++i) {
    const cv::Point at((i * 97) % 700 - 30, i % 3 == 0 ? -10 : (i * 53) % 560 - 40);
    const cv::Rect place = placeFor({110, 17}, at, image, taken);
    EXPECT_EQ(place & image, place) << i;
    EXPECT_EQ(place.size(), cv::Size(110, 17));
    if (i >= 12) continue;  // later there may be no free place nearby
    for (const auto& other : taken) EXPECT_TRUE((place & other).empty()) << i;
    taken.push_back(place);
  }
}

TEST(Overlay, ALabelOfAnObjectAtEachBorderIsDrawnWhole) {
  const std::string text = "car 1  0.90";
  const int width = sizeOf(text, {0.42}).width + 8;
  for (const double y : {-3.7, 0.0, 3.7}) {
    const cv::Mat image = drawn(frameOf(0, {objectAt(1, {8.0, y, 2.5})}));
    int longest = 0;  // run of non-black pixels, as the label has a background
    for (int row = 0; row < image.rows; ++row) {
      for (int col = 0, run = 0; col < image.cols; ++col) {
        const auto& p = image.at<cv::Vec3b>(row, col);
        run = p[0] + p[1] + p[2] > 0 ? run + 1 : 0;
        longest = std::max(longest, run);
      }
    }
    EXPECT_GE(longest, width) << y;
  }
}

TEST(Overlay, LargeImagesAreMadeSmallerAndAllSidesAreEven) {
  CameraCalibration camera = aheadCamera();
  camera.width = 1921, camera.height = 1081;
  const OverlayPicture large(camera, {});
  EXPECT_LE(large.imageArea().width, 1280);
  EXPECT_GE(large.imageArea().width, 1270);
  camera.width = 1241, camera.height = 375;
  const OverlayPicture kitti(camera, {});
  EXPECT_EQ(kitti.imageArea().size(), cv::Size(1240, 374));
  for (const cv::Size size : {large.size(), kitti.size()}) {
    EXPECT_EQ(size.width % 2, 0);
    EXPECT_EQ(size.height % 2, 0);
  }
  const cv::Mat image = cv::Mat::zeros(375, 1241, CV_8UC1);
  EXPECT_EQ(kitti.draw(image, frameOf(0, {}), {}, {}).size(), kitti.size());
}

TEST(Overlay, ThePlanShowsAnObjectAheadAboveTheBodyAndOneToTheLeftOnItsLeft) {
  const OverlayPicture picture(aheadCamera(), {.reach_m = 20.0});
  const auto plan = [&](const Eigen::Vector3d& p) {
    const cv::Mat whole = picture.draw(black(), frameOf(0, {objectAt(1, p)}), {}, {});
    return whole(cv::Rect(640, 30, whole.cols - 640, 480)).clone();
  };
  const double scale = 0.8 * 480 / 20.0, body_x = 0.5 * plan(kAhead).cols, body_y = 0.82 * 480;
  const auto at = [&](double x, double y) {
    return cv::Point2d(body_x - scale * y, body_y - scale * x);
  };
  const Colour car = classColour("car");
  // The rear edge of the outline, which is 4 m long and 2 m wide.
  EXPECT_EQ(coverage(plan({10, 0, 0}), at(8, 1), at(8, -1), car), 1.0);
  EXPECT_EQ(coverage(plan({10, 4, 0}), at(8, 5), at(8, 3), car), 1.0);
  EXPECT_EQ(coverage(plan({10, 4, 0}), at(8, 1), at(8, -1), car), 0.0);
}

TEST(Overlay, ReachIsThatOfTheObjectsInSight) {
  DriveLog log;
  EXPECT_EQ(usualReach(log), 30.0);
  log.add(messageOf(frameOf(0, {objectAt(1, {2, 0, 0}), objectAt(2, {2, 1, 0}),
                                objectAt(3, {300, 0, 0}, Visibility::kOutOfView)})));
  EXPECT_EQ(usualReach(log), 4.0);
  log.add(messageOf(frameOf(1, {objectAt(1, {20, 0, 0}), objectAt(2, {20, 0, 0})})));
  EXPECT_NEAR(usualReach(log), 23.0, 1e-9);
}

Frame frameWithPixels(std::uint64_t index, int value) {
  Frame frame;
  frame.stamp.sequence = index;
  frame.camera = "cam0";
  EXPECT_TRUE(vision::setPixels(frame, cv::Mat(480, 640, CV_8UC1, cv::Scalar(value))));
  return frame;
}

TEST(OverlayVideo, HasAsManyFramesAsWereGivenInTheirOrderAndSize) {
  const std::string file = ::testing::TempDir() + "/perdure_overlay.mp4";
  constexpr int kFrames = 23;
  cv::Size size;
  {
    OverlayWriter writer(file, aheadCamera(), 10.0, {});
    for (int i = 0; i < kFrames; ++i) {
      const auto index = static_cast<std::uint64_t>(i);
      ASSERT_TRUE(writer.add(frameWithPixels(index, 10 * i), frameOf(index, {})));
    }
    EXPECT_EQ(writer.frames(), std::size_t{kFrames});
    EXPECT_TRUE(writer.codec() == "H.264" || writer.codec() == "MPEG-4") << writer.codec();
    size = OverlayPicture(aheadCamera(), {}).size();
  }
  cv::VideoCapture video(file);
  ASSERT_TRUE(video.isOpened());
  EXPECT_NEAR(video.get(cv::CAP_PROP_FPS), 10.0, 0.01);
  cv::Mat image;
  int frames = 0;
  for (; video.read(image); ++frames) {
    EXPECT_EQ(image.size(), size);
    EXPECT_NEAR(image.at<cv::Vec3b>(300, 100)[1], 0.88 * 10 * frames, 6.0) << frames;
  }
  EXPECT_EQ(frames, kFrames);
}

TEST(OverlayVideo, RefusesFramesOfAnotherSizeAndSaysWhereNoFileOpens) {
  OverlayWriter writer("/proc/nowhere/overlay.mp4", aheadCamera(), 10.0, {});
  Frame small;
  ASSERT_TRUE(vision::setPixels(small, cv::Mat::zeros(10, 10, CV_8UC1)));
  EXPECT_EQ(writer.add(small, frameOf(0, {})).error().code, "image_size");
  EXPECT_EQ(writer.add(Frame{}, frameOf(0, {})).error().code, "image_missing");
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(writer.add(frameWithPixels(0, 0), frameOf(0, {})).error().code, "video_not_written");
  }
  EXPECT_EQ(writer.frames(), 0u);
}

TEST(OverlayVideo, IsDrawnFromTheFolderWithTheFramesThatHaveImages) {
  DriveLog log;
  for (std::uint64_t i = 0; i < 5; ++i) log.add(messageOf(frameOf(i, {})));
  const auto root = replay::tinyKittiTracking("overlay_images");  // three images
  const auto file = root / "overlay.mp4";
  std::size_t calls = 0, all = 0;
  const std::string sentence =
      writeOverlay(log, {.path = root, .sequence = "0000"}, file, [&](std::size_t, std::size_t n) {
        ++calls;
        all = n;
      });
  EXPECT_EQ(sentence.rfind("overlay.mp4: 3 frames", 0), 0u) << sentence;
  EXPECT_EQ(calls, 5u);
  EXPECT_EQ(all, 5u);
  EXPECT_NEAR(cv::VideoCapture(file.string()).get(cv::CAP_PROP_FRAME_COUNT), 3.0, 0.1);
}

TEST(OverlayVideo, ADriveWithoutImagesIsSaidInASentence) {
  DriveLog log;
  log.add(messageOf(frameOf(0, {})));
  const auto root = replay::tinyKittiTracking("overlay");
  const auto file = root / "overlay.mp4";
  const std::string sentence =
      writeOverlay(log, {.path = root, .sequence = "0001"}, file, [](auto, auto) {});
  EXPECT_NE(sentence.find("no images"), std::string::npos) << sentence;
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_NE(writeOverlay(log, {.path = "/nowhere"}, file, [](auto, auto) {}).find("/nowhere"),
            std::string::npos);
}

}  // namespace
}  // namespace perdure::tools
