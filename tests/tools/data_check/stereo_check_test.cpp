#include "tools/data_check/stereo/stereo_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/math/so3.h"
#include "tests/support/camera.h"

namespace perdure::tools {
namespace {

using Eigen::Vector3d;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kRadius_m = 3.0;

/// Grey value of a point on a sphere about B.
double greyAt(const Vector3d& p) {
  double sum = 0.0, phase = 0.0;
  for (int i = 1; i <= 24; ++i) {
    const Vector3d wave(std::sin(1.7 * i), std::cos(2.3 * i), std::sin(0.9 * i + 0.4));
    sum += std::sin((2.0 + 0.4 * i) * wave.dot(p) + (phase += 1.1));
  }
  return 128.0 + 22.0 * sum;
}

/// Renders the sphere for a camera at its pose in B, with the body rotated by `q_WB`.
Frame seenBy(const CameraCalibration& camera, const Eigen::Quaterniond& q_WB = {1, 0, 0, 0}) {
  const Vector3d p_B = camera.T_BC.p;
  Frame frame;
  frame.width = camera.width, frame.height = camera.height;
  frame.encoding = ImageEncoding::kMono8;
  auto pixels = std::make_shared<std::vector<std::uint8_t>>();
  for (unsigned v = 0; v < camera.height; ++v) {
    for (unsigned u = 0; u < camera.width; ++u) {
      const Vector3d in_C((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
      const Vector3d ray = camera.T_BC.q * in_C.normalized();
      const double along = p_B.dot(ray);
      const double depth =
          -along + std::sqrt(along * along + kRadius_m * kRadius_m - p_B.squaredNorm());
      pixels->push_back(cv::saturate_cast<std::uint8_t>(greyAt(q_WB * (p_B + depth * ray))));
    }
  }
  frame.data = pixels;
  return frame;
}

/// Rearranges the pixels of an image: `from` maps a pixel's index to the index of its new value.
Frame rearranged(const Frame& frame, const std::function<std::size_t(std::size_t)>& from) {
  Frame other = frame;
  auto pixels = std::make_shared<std::vector<std::uint8_t>>();
  for (std::size_t i = 0; i < frame.data->size(); ++i) {
    pixels->push_back((*frame.data)[from(i)]);
  }
  other.data = pixels;
  return other;
}

/// Two cameras 12 cm apart.
Calibration twoCameras(std::uint32_t width = 320, std::uint32_t width_1 = 320) {
  const auto ahead = [](std::uint32_t w, double y) {
    return tests::cameraAhead(w, 3 * w / 4, 220.0 * w / 320.0, {0.0, y, 0.0});
  };
  Calibration calibration;
  calibration.cameras = {ahead(width, 0.06), ahead(width_1, -0.06)};
  calibration.cameras[1].name = "cam1";
  return calibration;
}

void addFrame(replay::Recording& recording, std::uint64_t i, std::size_t camera, Frame frame,
              TimePoint time = {}) {
  replay::Recording::FrameFile file;
  file.time = time, file.index = i, file.camera = camera;
  file.load = [frame = std::move(frame)] { return Result<Frame>(frame); };
  recording.frames.push_back(file);
}

/// Two stereo pairs; `show` changes the images of cam1.
replay::Recording twoPairs(
    const Calibration& calibration,
    const std::function<Frame(const Frame&)>& show = [](const Frame& seen) { return seen; }) {
  replay::Recording recording;
  recording.calibration = calibration;
  const auto& cameras = recording.calibration.cameras;
  for (std::uint64_t i = 0; i < 2; ++i) {
    addFrame(recording, i, 0, seenBy(cameras[0]));
    addFrame(recording, i, 1, show(seenBy(cameras[1])));
  }
  return recording;
}

/// Returns the findings after a change of the second camera's pose in the calibration.
replay::DataFindings findingsWith(const std::function<void(RigidTransform&)>& change) {
  replay::Recording recording = twoPairs(twoCameras());
  change(recording.calibration.cameras[1].T_BC);
  return checkStereo(recording);
}

std::vector<std::string> stereoCodesOf(const replay::DataFindings& findings) {
  std::vector<std::string> codes;
  for (const auto& finding : findings) codes.push_back(finding.code);
  return codes;
}
std::vector<std::string> codesWith(const std::function<void(RigidTransform&)>& change) {
  return stereoCodesOf(findingsWith(change));
}

TEST(StereoCheck, TwoCamerasThatFitHaveNoFinding) {
  EXPECT_THAT(codesWith([](RigidTransform&) {}), ElementsAre());
}

TEST(StereoCheck, ASecondCameraThatIsTurnedIsDoubtful) {
  const auto turned = findingsWith([](RigidTransform& T_BC) {
    T_BC.q = T_BC.q * expQuaternion(Vector3d(3.0 * M_PI / 180.0, 0.0, 0.0));
  });
  ASSERT_EQ(turned.size(), 1U);
  EXPECT_EQ(turned[0].code, "stereo_turned");
  EXPECT_THAT(turned[0].text, HasSubstr("T_BS of cam1 does not fit that of cam0"));
  EXPECT_THAT(turned[0].text, HasSubstr("about 3.0° about its horizontal axis"));
  EXPECT_THAT(codesWith([](RigidTransform& T_BC) { T_BC = T_BC.inverse(); }),
              ElementsAre("stereo_epipolar"));
}

TEST(StereoCheck, TwoCamerasAtOnePlaceOrExchangedAreDoubtful) {
  EXPECT_THAT(codesWith([](RigidTransform& T_BC) { T_BC.p.y() = 0.06; }),
              ElementsAre("stereo_same_place"));
  EXPECT_THAT(codesWith([](RigidTransform& T_BC) { T_BC.p.y() = 0.18; }),
              ElementsAre("stereo_wrong_side"));
}

TEST(StereoCheck, CamerasOfDifferentSizeOrDirectionAreCompared) {
  EXPECT_THAT(stereoCodesOf(checkStereo(twoPairs(twoCameras(320, 160)))), ElementsAre());
  EXPECT_THAT(stereoCodesOf(checkStereo(twoPairs(twoCameras(160, 320)))), ElementsAre());
  Calibration hanging = twoCameras(320, 240);
  hanging.cameras[1].T_BC.q = hanging.cameras[1].T_BC.q * expQuaternion({0.0, 0.0, M_PI});
  EXPECT_THAT(stereoCodesOf(checkStereo(twoPairs(hanging))), ElementsAre());
}

TEST(StereoCheck, ExposureIsNoMatter) {
  const auto darker = [](const Frame& seen) {
    Frame frame = seen;
    auto pixels = std::make_shared<std::vector<std::uint8_t>>();
    for (std::size_t i = 0; i < seen.data->size(); ++i) {
      pixels->push_back(static_cast<std::uint8_t>(20.0 + 0.3 * (*seen.data)[i]));
    }
    frame.data = pixels;
    return frame;
  };
  EXPECT_THAT(stereoCodesOf(checkStereo(twoPairs(twoCameras(), darker))), ElementsAre());
}

TEST(StereoCheck, ASecondCameraUpsideDownOrMirroredIsNamed) {
  const auto upside_down = checkStereo(twoPairs(twoCameras(), [](const Frame& seen) {
    return rearranged(seen, [&](std::size_t i) { return seen.data->size() - 1 - i; });
  }));
  ASSERT_THAT(stereoCodesOf(upside_down), ElementsAre("stereo_flipped"));
  EXPECT_THAT(upside_down[0].text, HasSubstr("images of cam1 are upside down"));
  const auto mirrored = checkStereo(twoPairs(twoCameras(), [](const Frame& seen) {
    return rearranged(seen, [&](std::size_t i) { return i - i % 320 + 319 - i % 320; });
  }));
  ASSERT_THAT(stereoCodesOf(mirrored), ElementsAre("stereo_flipped"));
  EXPECT_THAT(mirrored[0].text, HasSubstr("images of cam1 are mirrored"));
}

TEST(StereoCheck, ImagesOfSomethingElseAreDoubtful) {
  Calibration elsewhere = twoCameras();
  const auto behind = seenBy(elsewhere.cameras[1], expQuaternion({0.0, 0.0, 2.5}));
  const auto findings = checkStereo(twoPairs(elsewhere, [&](const Frame&) { return behind; }));
  ASSERT_THAT(stereoCodesOf(findings), ElementsAre("stereo_unmatched"));
  EXPECT_THAT(findings[0].text, HasSubstr("of the corners of cam0 are found in cam1"));
}

TEST(StereoCheck, ATurnAboutTheVerticalAxisIsNoExchange) {
  for (const double degrees : {2.0, 10.0}) {
    const auto findings = findingsWith([&](RigidTransform& T_BC) {
      T_BC.q = T_BC.q * expQuaternion(Vector3d(0.0, degrees * M_PI / 180.0, 0.0));
    });
    ASSERT_THAT(stereoCodesOf(findings), ElementsAre("stereo_turned"));
    EXPECT_THAT(findings[0].text, HasSubstr(degrees > 5.0 ? "about 10." : "about 2."));
    EXPECT_THAT(findings[0].text, HasSubstr("about its vertical axis"));
  }
}

TEST(StereoCheck, OneImageForBothCamerasIsNamed) {
  const Frame first = seenBy(twoCameras().cameras[0]);
  EXPECT_THAT(
      stereoCodesOf(checkStereo(twoPairs(twoCameras(), [&](const Frame&) { return first; }))),
      ElementsAre("stereo_same_images"));
}

TEST(StereoCheck, LateStampsOfTheSecondCameraAreToldFromAWrongPlace) {
  replay::Recording recording;
  recording.calibration = twoCameras(160, 160);
  constexpr int kLate = 4;
  for (int i = 0; i < 60; ++i) {
    for (int c = 0; c < 2; ++c) {
      const double t = 0.1 * (c == 0 ? i : i - kLate);
      const Vector3d turn(0.1 * std::sin(2.1 * t), 0.1 * std::cos(1.7 * t),
                          0.4 * std::sin(1.3 * t));
      addFrame(
          recording, static_cast<std::uint64_t>(i), static_cast<std::size_t>(c),
          seenBy(recording.calibration.cameras[static_cast<std::size_t>(c)], expQuaternion(turn)),
          fromNanoseconds(1'000'000'000 + 100'000'000LL * i));
    }
  }
  const auto findings = checkStereo(recording);
  ASSERT_THAT(stereoCodesOf(findings), ElementsAre("stereo_stamps"));
  EXPECT_THAT(findings[0].text,
              AnyOf(HasSubstr("are 0.39 s too late"), HasSubstr("are 0.40 s too late"),
                    HasSubstr("are 0.41 s too late")));
}

}  // namespace
}  // namespace perdure::tools
