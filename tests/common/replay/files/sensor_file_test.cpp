// Calibrations with the keys of other tools: Kalibr, ROS.
#include "common/replay/files/sensor_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/replay/files/rig_file.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kPlace[] = "T_BS:\n  data: [0,0,1,0.1, -1,0,0,0, 0,-1,0,0.05, 0,0,0,1]\n";
constexpr char kSize[] = "resolution: [160, 120]\nintrinsics: [100.0, 101.0, 80.0, 60.0]\n";

CameraCalibration cameraOfYaml(const std::string& yaml) {
  const fs::path file = freshFolder("sensor_file") / "sensor.yaml";
  writeText(file, yaml);
  return readCamera(SensorFile(file), "cam0");
}
std::string errorOfYaml(const std::string& yaml) {
  return startupErrorOf([&] { cameraOfYaml(yaml); });
}
std::string lens(const std::string& model, const std::string& coefficients) {
  return std::string(kPlace) + kSize + "distortion_model: " + model +
         "\ndistortion_coefficients: " + coefficients + "\n";
}

TEST(SensorFileOfOthers, NamesOfOneModelAreOne) {
  for (const char* name : {"radtan", "plumb_bob", "radial-tangential", "PLUMB_BOB"}) {
    const auto camera = cameraOfYaml(lens(name, "[-0.3, 0.1, 0.001, 0.002]"));
    EXPECT_EQ(camera.distortion, DistortionModel::kRadialTangential) << name;
    EXPECT_THAT(camera.distortion_coefficients, ElementsAre(-0.3, 0.1, 0.001, 0.002));
  }
  for (const char* name : {"equi", "equidistant", "fisheye", "kannala_brandt"}) {
    EXPECT_EQ(cameraOfYaml(lens(name, "[0.1, 0, 0, 0]")).distortion, DistortionModel::kEquidistant)
        << name;
  }
  for (const char* name : {"pinhole-radtan", "pinhole-equi"}) {
    const auto camera = cameraOfYaml(std::string(kPlace) + kSize + "camera_model: " + name +
                                     "\ndistortion_coeffs: [0.1, 0, 0, 0]\n");
    EXPECT_EQ(camera.distortion == DistortionModel::kEquidistant,
              std::string(name) == "pinhole-equi");
  }
}

TEST(SensorFileOfOthers, FiveAndEightCoefficientsAreTaken) {
  EXPECT_EQ(cameraOfYaml(lens("plumb_bob", "[-0.3, 0.1, 0, 0, 0]")).distortion,
            DistortionModel::kRadialTangential)
      << "k3 is 0";
  const auto five = cameraOfYaml(lens("plumb_bob", "[-0.3, 0.1, 0.01, 0.02, -0.05]"));
  EXPECT_EQ(five.distortion, DistortionModel::kRational);
  EXPECT_THAT(five.distortion_coefficients, ElementsAre(-0.3, 0.1, 0.01, 0.02, -0.05, 0, 0, 0));
  const auto eight = cameraOfYaml(lens("rational_polynomial", "[1, 2, 3, 4, 5, 6, 7, 8]"));
  EXPECT_THAT(eight.distortion_coefficients, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_THAT(errorOfYaml(lens("plumb_bob", "[1, 2, 3]")), HasSubstr("4, 5 or 8 numbers"));
  EXPECT_THAT(errorOfYaml(lens("equi", "[1, 2, 3, 4, 5]")), HasSubstr("has not 4 numbers"));
}

TEST(SensorFileOfOthers, ALensThatIsNotReadIsNamedWithTheFix) {
  EXPECT_THAT(errorOfYaml(std::string(kPlace) + kSize + "camera_model: scaramuzza\n"),
              HasSubstr("pinhole-equi"));
  EXPECT_THAT(errorOfYaml(std::string(kPlace) + kSize + "camera_model: ds\n"),
              HasSubstr("intrinsics is missing or has not 6 numbers"));
  EXPECT_THAT(errorOfYaml(lens("fov", "[0.9]")), HasSubstr("`fov`"));
  EXPECT_THAT(errorOfYaml(lens("none", "[0.9, 0, 0, 0]")), HasSubstr("is none, but there are"));
}

TEST(SensorFileOfOthers, RosCameraInfoIsReadButSaysNotWhereTheCameraIs) {
  const std::string info =
      "image_width: 640\nimage_height: 480\ncamera_name: left\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [400, 0, 320, 0, 401, 240, 0, 0, 1]\n"
      "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
      "  data: [-0.1, 0.01, 0, 0, 0]\n"
      "rectification_matrix:\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
      "projection_matrix:\n  data: [400, 0, 320, 0, 0, 401, 240, 0, 0, 0, 1, 0]\n";
  EXPECT_THAT(errorOfYaml(info), HasSubstr("T_BS is missing"));
  const auto camera = cameraOfYaml(info + kPlace);
  EXPECT_EQ(camera.width, 640U);
  EXPECT_EQ(camera.fy, 401.0);
  EXPECT_EQ(camera.cy, 240.0);
  EXPECT_EQ(camera.distortion, DistortionModel::kRadialTangential);
}

TEST(SensorFileOfOthers, KalibrsTransformIsTheInverseAndTheOtherOneIsNot) {
  const auto T_BC = cameraOfYaml(std::string(kPlace) + kSize).T_BC;
  const char* inverse =
      "T_cam_imu:\n- [0.0, -1.0, 0.0, 0.0]\n- [0.0, 0.0, -1.0, 0.05]\n- [1.0, 0.0, 0.0, -0.1]\n"
      "- [0.0, 0.0, 0.0, 1.0]\n";
  EXPECT_LT(boxMinus(cameraOfYaml(std::string(inverse) + kSize).T_BC, T_BC).norm(), 1e-12);
  const char* same = "T_imu_cam: [[0,0,1,0.1], [-1,0,0,0], [0,-1,0,0.05], [0,0,0,1]]\n";
  EXPECT_LT(boxMinus(cameraOfYaml(std::string(same) + kSize).T_BC, T_BC).norm(), 1e-12);
}

TEST(SensorFileOfOthers, WithoutATransformNothingIsAssumed) {
  EXPECT_THAT(errorOfYaml(kSize), HasSubstr("T_BS is missing, and so are T_cam_imu and T_imu_cam"));
}

TEST(SensorFileOfOthers, KalibrsChainIsARig) {
  const fs::path file = freshFolder("chain") / "camchain-imucam.yaml";
  const std::string common =
      "  camera_model: pinhole\n  distortion_coeffs: [0.01, 0.02, 0.0, 0.0]\n"
      "  distortion_model: equidistant\n  intrinsics: [190.0, 190.0, 254.0, 256.0]\n"
      "  resolution: [512, 512]\n  rostopic: /cam\n";
  writeText(file, "cam0:\n  T_cam_imu: [[0,-1,0,0], [0,0,-1,0.05], [1,0,0,-0.1], [0,0,0,1]]\n" +
                      common +
                      "cam1:\n  T_cn_cnm1: [[1,0,0,-0.1], [0,1,0,0], [0,0,1,0], [0,0,0,1]]\n" +
                      common + "  colour: red\n");
  std::vector<std::string> notes;
  const Calibration rig = readRig(file, &notes);
  ASSERT_EQ(rig.cameras.size(), 2U);
  // cam1 is 0.1 m to the right of cam0, along the body's -y.
  EXPECT_TRUE(rig.cameras[0].T_BC.p.isApprox(Eigen::Vector3d(0.1, 0.0, 0.05)));
  EXPECT_TRUE(rig.cameras[1].T_BC.p.isApprox(Eigen::Vector3d(0.1, -0.1, 0.05)));
  EXPECT_THAT(notes, ElementsAre(HasSubstr("cam1: the key `colour`")));
}

TEST(SensorFileOfOthers, ALensOfEightCoefficientsIsWrittenAsItIsRead) {
  const auto camera =
      cameraOfYaml(lens("radtan", "[0.1, 0.02, 0.003, 0.004, 0.5, 0.06, 0.007, 0.8]"));
  const auto again = cameraOfYaml(std::string(kPlace) + cameraKeys(camera));
  EXPECT_EQ(again.distortion, DistortionModel::kRational);
  EXPECT_EQ(again.distortion_coefficients, camera.distortion_coefficients);
}

}  // namespace
}  // namespace perdure::replay
