#include "tools/data_check/stereo_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/math/so3.h"
#include "tests/support/camera.h"

namespace perdure::tools {
namespace {

using Eigen::Vector3d;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kRadius_m = 3.0;

/// A grey value for a place on a sphere about B.
double greyAt(const Vector3d& p) {
  double sum = 0.0, phase = 0.0;
  for (int i = 1; i <= 24; ++i) {
    const Vector3d wave(std::sin(1.7 * i), std::cos(2.3 * i), std::sin(0.9 * i + 0.4));
    sum += std::sin((2.0 + 0.4 * i) * wave.dot(p) + (phase += 1.1));
  }
  return 128.0 + 22.0 * sum;
}

/// What a camera at `p_B` that looks ahead sees of the sphere.
Frame seenFrom(const CameraCalibration& camera, const Vector3d& p_B) {
  Frame frame;
  frame.width = camera.width, frame.height = camera.height;
  frame.encoding = ImageEncoding::kMono8;
  auto pixels = std::make_shared<std::vector<std::uint8_t>>();
  for (unsigned v = 0; v < camera.height; ++v) {
    for (unsigned u = 0; u < camera.width; ++u) {
      const Vector3d in_C((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
      const Vector3d ray = tests::lookingAhead() * in_C.normalized();
      const double along = p_B.dot(ray);
      const double depth =
          -along + std::sqrt(along * along + kRadius_m * kRadius_m - p_B.squaredNorm());
      pixels->push_back(cv::saturate_cast<std::uint8_t>(greyAt(p_B + depth * ray)));
    }
  }
  frame.data = pixels;
  return frame;
}

/// Two cameras 12 cm apart; the calibration has the second one's place changed.
replay::DataFindings findingsWith(const std::function<void(RigidTransform&)>& change) {
  const Vector3d left(0.0, 0.06, 0.0), right(0.0, -0.06, 0.0);
  replay::Recording recording;
  auto& cameras = recording.calibration.cameras;
  cameras = {tests::cameraAhead(320, 240, 220.0, left), tests::cameraAhead(320, 240, 220.0, right)};
  cameras[1].name = "cam1";
  for (std::uint64_t i = 0; i < 2; ++i) {
    for (std::size_t c = 0; c < 2; ++c) {
      replay::Recording::FrameFile file;
      file.index = i, file.camera = c;
      file.load = [frame = seenFrom(cameras[c], c == 0 ? left : right)] {
        return Result<Frame>(frame);
      };
      recording.frames.push_back(file);
    }
  }
  change(cameras[1].T_BC);
  return checkStereo(recording);
}

std::vector<std::string> codesWith(const std::function<void(RigidTransform&)>& change) {
  std::vector<std::string> codes;
  for (const auto& finding : findingsWith(change)) codes.push_back(finding.code);
  return codes;
}

TEST(StereoCheck, TwoCamerasThatFitHaveNoFinding) {
  EXPECT_THAT(codesWith([](RigidTransform&) {}), ElementsAre());
}

TEST(StereoCheck, ASecondCameraThatIsTurnedIsDoubtful) {
  const auto turned = findingsWith([](RigidTransform& T_BC) {
    T_BC.q = T_BC.q * expQuaternion(Vector3d(3.0 * M_PI / 180.0, 0.0, 0.0));
  });
  ASSERT_EQ(turned.size(), 1U);
  EXPECT_EQ(turned[0].code, "stereo_epipolar");
  EXPECT_THAT(turned[0].text, HasSubstr("T_BS of cam1 does not fit that of cam0"));
  EXPECT_THAT(turned[0].text, HasSubstr("11 px"));
  EXPECT_THAT(codesWith([](RigidTransform& T_BC) { T_BC = T_BC.inverse(); }),
              ElementsAre("stereo_epipolar"));
}

TEST(StereoCheck, TwoCamerasAtOnePlaceOrExchangedAreDoubtful) {
  EXPECT_THAT(codesWith([](RigidTransform& T_BC) { T_BC.p.y() = 0.06; }),
              ElementsAre("stereo_same_place"));
  EXPECT_THAT(codesWith([](RigidTransform& T_BC) { T_BC.p.y() = 0.18; }),
              ElementsAre("stereo_wrong_side"));
}

}  // namespace
}  // namespace perdure::tools
