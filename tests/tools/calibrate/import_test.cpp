// Tests the import of foreign calibrations. The rigs must equal the native file to the last
// relevant digit, and unknown keys are reported by name.
#include "tools/calibrate/import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"

namespace perdure::calibrate {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class RigImport : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("perdure_rig_import_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path file(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  std::string errorOf(const std::vector<fs::path>& files,
                      const std::vector<RigidTransform>& places = {}) const {
    try {
      importRig(files, places);
    } catch (const StartupError& e) {
      return e.what();
    }
    return "it was taken";
  }
  fs::path folder_;
};

const std::string kNative =
    "cam0:\n  T_BS:\n    cols: 4\n    rows: 4\n"
    "    data: [0, 0, 1, 0.07, -1, 0, 0, 0.01, 0, -1, 0, -0.02, 0, 0, 0, 1]\n"
    "  rate_hz: 20\n  resolution: [752, 480]\n  intrinsics: [458.654, 457.296, 367.215, 248.375]\n"
    "  distortion_model: radial-tangential\n"
    "  distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n"
    "  time_offset_s: 0.0031\n"
    "imu0:\n  rate_hz: 200\n  gyroscope_noise_density: 1.6968e-04\n"
    "  gyroscope_random_walk: 1.9393e-05\n  accelerometer_noise_density: 2.0e-3\n"
    "  accelerometer_random_walk: 3.0e-3\n";

// The calibration in Kalibr's form: T_cam_imu is the inverse of T_BS.
const std::string kChain =
    "cam0:\n  T_cam_imu:\n  - [0.0, -1.0, 0.0, 0.01]\n  - [0.0, 0.0, -1.0, -0.02]\n"
    "  - [1.0, 0.0, 0.0, -0.07]\n  - [0.0, 0.0, 0.0, 1.0]\n  cam_overlaps: []\n"
    "  camera_model: pinhole\n"
    "  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n"
    "  distortion_model: radtan\n  intrinsics: [458.654, 457.296, 367.215, 248.375]\n"
    "  resolution: [752, 480]\n  rostopic: /cam0/image_raw\n  timeshift_cam_imu: 0.0031\n";

const std::string kKalibrImu =
    "rostopic: /imu0\nupdate_rate: 200.0\ngyroscope_noise_density: 1.6968e-04\n"
    "gyroscope_random_walk: 1.9393e-05\naccelerometer_noise_density: 2.0e-3\n"
    "accelerometer_random_walk: 3.0e-3\n";

const std::string kCameraInfo =
    "image_width: 752\nimage_height: 480\ncamera_name: narrow\n"
    "camera_matrix:\n  rows: 3\n  cols: 3\n"
    "  data: [458.654, 0, 367.215, 0, 457.296, 248.375, 0, 0, 1]\n"
    "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
    "  data: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0]\n"
    "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
    "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]\n";

void expectSame(const Calibration& a, const Calibration& b) {
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (std::size_t i = 0; i < a.cameras.size(); ++i) {
    const auto &c = a.cameras[i], &d = b.cameras[i];
    EXPECT_LT((c.T_BC.matrix() - d.T_BC.matrix()).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_EQ(c.width, d.width);
    EXPECT_EQ(c.fx, d.fx);
    EXPECT_EQ(c.cy, d.cy);
    EXPECT_EQ(c.distortion, d.distortion);
    EXPECT_EQ(c.distortion_coefficients, d.distortion_coefficients);
    EXPECT_EQ(c.time_offset_s, d.time_offset_s);
  }
  ASSERT_EQ(a.imu.has_value(), b.imu.has_value());
  if (!a.imu) return;
  EXPECT_EQ(a.imu->rate_hz, b.imu->rate_hz);
  EXPECT_EQ(a.imu->gyro_noise, b.imu->gyro_noise);
  EXPECT_EQ(a.imu->accel_bias_walk, b.imu->accel_bias_walk);
}

TEST_F(RigImport, KalibrsFilesAreTheNativeRig) {
  const Calibration native = replay::readRig(file("native.yaml", kNative));
  const auto imported =
      importRig({file("camchain-imucam.yaml", kChain), file("imu.yaml", kKalibrImu)});
  EXPECT_TRUE(imported.ignored.empty()) << imported.ignored.front();
  expectSame(imported.rig, native);
  // The written file must read back the same.
  expectSame(replay::readRig(file("rig.yaml", replay::rigText(imported.rig, "imported"))), native);
}

// The calibration in the formats of other programs.
const std::string kVinsLens =
    "%YAML:1.0\n---\nmodel_type: PINHOLE\ncamera_name: camera\nimage_width: 752\n"
    "image_height: 480\ndistortion_parameters:\n   k1: -0.28340811\n   k2: 0.07395907\n"
    "   p1: 0.00019359\n   p2: 1.76187114e-05\nprojection_parameters:\n   fx: 458.654\n"
    "   fy: 457.296\n   cx: 367.215\n   cy: 248.375\n";
const std::string kVinsNoise = "acc_n: 0.08\ngyr_n: 0.004\nacc_w: 4.0e-5\ngyr_w: 2.0e-6\n";
const std::string kMatrix =
    "!!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: "
    "[0, 0, 1, 0.07, -1, 0, 0, 0.01, 0, -1, 0, -0.02, 0, 0, 0, 1]\n";
const std::string kOrbSlam =
    "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"PinHole\"\nCamera1.fx: 458.654\n"
    "Camera1.fy: 457.296\nCamera1.cx: 367.215\nCamera1.cy: 248.375\nCamera1.k1: -0.28340811\n"
    "Camera1.k2: 0.07395907\nCamera1.p1: 0.00019359\nCamera1.p2: 1.76187114e-05\n"
    "Camera.width: 752\nCamera.height: 480\nCamera.newWidth: 600\nCamera.fps: 20\nIMU.T_b_c1: " +
    kMatrix +
    "IMU.NoiseGyro: 1.6968e-04\nIMU.NoiseAcc: 2.0e-3\nIMU.GyroWalk: 1.9393e-05\n"
    "IMU.AccWalk: 3.0e-3\nIMU.Frequency: 200.0\nORBextractor.nFeatures: 1000\n";

TEST_F(RigImport, CalibrationsOfVinsAndOrbSlamAreTheNativeRig) {
  const Calibration native = replay::readRig(file("native.yaml", kNative));
  Calibration without_imu = native;
  without_imu.imu.reset();
  const auto mono = importRig(
      {file("vins_mono.yaml",
            kVinsLens + kVinsNoise +
                "imu_topic: \"/imu0\"\nextrinsicRotation: !!opencv-matrix\n   rows: 3\n   cols: 3\n"
                "   dt: d\n   data: [0, 0, 1, -1, 0, 0, 0, -1, 0]\nextrinsicTranslation: "
                "!!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [0.07, 0.01, -0.02]\n"
                "td: 0.0031\nrolling_shutter: 0\nrolling_shutter_tr: 0.02\n")});
  expectSame(mono.rig, without_imu);
  EXPECT_THAT(mono.found, Contains(HasSubstr("no noise of the IMU")));
  file("cam0_pinhole.yaml", kVinsLens);
  const fs::path fusion = file("vins_fusion.yaml",
                               "%YAML:1.0\nimu: 1\nnum_of_cam: 1\ncam0_calib: "
                               "\"cam0_pinhole.yaml\"\nbody_T_cam0: " +
                                   kMatrix + kVinsNoise + "td: 0.0031\n");
  expectSame(importRig({fusion}).rig, without_imu);
  expectSame(importRig({fusion.parent_path() / "cam0_pinhole.yaml", fusion, fusion}).rig,
             without_imu);
  expectSame(importRig({fusion, file("imu.yaml", kKalibrImu)}).rig, native);
  EXPECT_THAT(importRig({file("orb.yaml", kOrbSlam)}).ignored, testing::IsEmpty());
  EXPECT_THAT(importRig({file("orb.yaml", kOrbSlam + "Camera1.k4: .1\nIMU.Tbc: 1\n")}).ignored,
              testing::ElementsAre(HasSubstr("`Camera1.k4`"), HasSubstr("`IMU.Tbc`")));
  Calibration orb = importRig({file("orb.yaml", kOrbSlam)}).rig;
  EXPECT_EQ(orb.cameras[0].rate_hz, 20.0);
  orb.cameras[0].time_offset_s = 0.0031;  // ORB-SLAM3 has no time offset
  expectSame(orb, native);
}

TEST_F(RigImport, TheSecondCameraOfOrbSlamIsPlacedByTheFirst) {
  const std::string second =
      "Camera2.fx: 457\nCamera2.fy: 456\nCamera2.cx: 379\nCamera2.cy: 255\nStereo.T_c1_c2: "
      "!!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: f\n"
      "   data: [1, 0, 0, 0.11, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n";
  const auto rig = importRig({file("orb.yaml", kOrbSlam + second)}).rig;
  ASSERT_EQ(rig.cameras.size(), 2u);
  const RigidTransform T_C0_C1 = rig.cameras[0].T_BC.inverse() * rig.cameras[1].T_BC;
  EXPECT_NEAR(T_C0_C1.p.x(), 0.11, 1e-12);
  EXPECT_EQ(rig.cameras[1].distortion, DistortionModel::kNone);
}

TEST_F(RigImport, RollingShutterOfVinsIsStampedAtTheFirstRow) {
  const auto rig =
      importRig(
          {file("vins.yaml", kVinsLens + "body_T_cam0: " + kMatrix +
                                 "td: -0.01\nrolling_shutter: 1\nrolling_shutter_tr: 0.02\n")})
          .rig;
  EXPECT_NEAR(rig.cameras[0].time_offset_s, 0.0, 1e-12);
  EXPECT_EQ(rig.cameras[0].readout_s, 0.02);
}

std::string basalt(const std::string& accel_scale = "0.0") {
  return "{\"value0\": {\"T_imu_cam\": [{\"px\": 0.07, \"py\": 0.01, \"pz\": -0.02,\n"
         "\"qx\": -0.5, \"qy\": 0.5, \"qz\": -0.5, \"qw\": 0.5}], \"intrinsics\": [\n"
         "{\"camera_type\": \"kb4\", \"intrinsics\": {\"fx\": 380.8, \"fy\": 380.7, "
         "\"cx\": 510.3,\n\"cy\": 514.3, \"k1\": 0.01, \"k2\": -0.02, \"k3\": 0.03, \"k4\": "
         "-0.004}}],\n\"resolution\": [[1024, 1024]], \"vignette\": [],\n"
         "\"calib_accel_bias\": [0.01, 0.02, 0.03, " +
         accel_scale +
         ", 0, 0, 0, 0, 0], \"calib_gyro_bias\": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],\n"
         "\"imu_update_rate\": 200.0, \"accel_noise_std\": [0.016, 0.016, 0.02],\n"
         "\"gyro_noise_std\": [0.000282, 0.000282, 0.000282], \"accel_bias_std\": [0.001, 0.001, "
         "0.001],\n\"gyro_bias_std\": [0.0001, 0.0001, 0.0001], \"cam_time_offset_ns\": "
         "-3000000}}\n";
}

TEST_F(RigImport, BasaltsJsonIsRead) {
  const auto rig = importRig({file("calibration.json", basalt())}).rig;
  const auto& camera = rig.cameras.at(0);
  EXPECT_EQ(camera.distortion, DistortionModel::kEquidistant);
  EXPECT_EQ(camera.distortion_coefficients[3], -0.004);
  EXPECT_EQ(camera.width, 1024u);
  EXPECT_DOUBLE_EQ(camera.time_offset_s, -0.003);
  EXPECT_LT(
      (camera.T_BC.matrix() - transformOf("0 0 1 .07  -1 0 0 .01  0 -1 0 -.02  0 0 0 1").matrix())
          .cwiseAbs()
          .maxCoeff(),
      1e-12);
  ASSERT_TRUE(rig.imu);
  EXPECT_EQ(rig.imu->accel_noise, 0.02);
  EXPECT_EQ(rig.imu->gyro_bias_walk, 0.0001);
  EXPECT_THAT(
      importRig({file("scaled.json", basalt("0.012"))}).ignored,
      ElementsAre(HasSubstr("calib_accel_bias holds scales and misalignments of up to 1.2 %")));
}

TEST_F(RigImport, WhatBasaltsJsonLacksIsNamed) {
  const auto without = [&](const std::string& what, const std::string& put) {
    std::string text = basalt();
    text.replace(text.find(what), what.size(), put);
    return errorOf({file("calibration.json", text)});
  };
  EXPECT_THAT(without("\"T_imu_cam\"", "\"other\""), HasSubstr("T_imu_cam is missing"));
  EXPECT_THAT(without("\"intrinsics\": [", "\"other\": ["), HasSubstr("intrinsics is missing"));
  EXPECT_THAT(without("\"gyro_noise_std\"", "\"other\""), HasSubstr("gyro_noise_std"));
}

TEST_F(RigImport, KalibrsCamerasAreSeenFromAnotherImuThanTheReference) {
  const std::string other =
      "T_i_b:\n- [1, 0, 0, 0.5]\n- [0, 1, 0, 0]\n- [0, 0, 1, 0]\n"
      "- [0, 0, 0, 1]\n";
  const auto chain = file("camchain.yaml", kChain);
  const auto place = [&](const std::string& imu) {
    return importRig({chain, file("imu.yaml", imu)}).rig.cameras[0].T_BC.p.x();
  };
  EXPECT_NEAR(place(kKalibrImu), 0.07, 1e-12);
  EXPECT_NEAR(place(kKalibrImu + other), 0.57, 1e-12);
}

TEST_F(RigImport, FilesOfOtherProgramsAreNamedAsARig) {
  const auto why = [&](const std::string& name, const std::string& text) -> std::string {
    try {
      replay::readRigParts(file(name, text));
    } catch (const StartupError& error) {
      return error.what();
    }
    return "it was taken";
  };
  const std::string imports = "`perdure calibrate import ";
  EXPECT_THAT(why("orb.yaml", kOrbSlam), AllOf(HasSubstr("of ORB-SLAM3"), HasSubstr(imports)));
  EXPECT_THAT(why("vins.yaml", kVinsLens), AllOf(HasSubstr("of VINS"), HasSubstr(imports)));
  EXPECT_THAT(why("basalt.json", basalt()), AllOf(HasSubstr("of Basalt"), HasSubstr(imports)));
  EXPECT_THAT(why("imu.yaml", kKalibrImu), AllOf(HasSubstr("an IMU's alone"), HasSubstr(imports)));
  EXPECT_THAT(why("ost.yaml", kCameraInfo), AllOf(HasSubstr("camera_info"), HasSubstr(imports)));
  EXPECT_THAT(
      why("sai.json", "{\"cameras\": [{\"focalLengthX\": 500}]}"),
      AllOf(HasSubstr("of Spectacular AI, OKVIS or maplab (not imported)"), Not(HasSubstr(imports))));
  EXPECT_THAT(why("board.yaml", "target_type: aprilgrid\n"),
              HasSubstr("Kalibr's description of a"));
  EXPECT_THAT(why("other.yaml", "speed: 3\n"),
              HasSubstr("none of the sections cam0, cam1 and imu0"));
}

TEST_F(RigImport, CameraInfoIsTheSameWithAPlace) {
  const auto info = file("ost.yaml", kCameraInfo),
             imu =
                 file("imu.yaml",
                      "imu0:\n  model: calibrated\n  T_i_b: "
                      "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n  rate_hz: 200\n  "
                      "gyroscope_noise_density: 1.6968e-04\n  gyroscope_random_walk: 1.9393e-05\n  "
                      "accelerometer_noise_density: 2.0e-3\n  accelerometer_random_walk: 3.0e-3\n");
  const std::string why = errorOf({info, imu});
  EXPECT_THAT(why, HasSubstr("does not say where the camera is on the IMU"));
  EXPECT_THAT(why, HasSubstr("--T_BS"));
  const auto T_BS = transformOf("0 0 1 .07  -1 0 0 .01  0 -1 0 -.02  0 0 0 1");
  auto imported = importRig({info, imu}, {T_BS});
  EXPECT_TRUE(imported.ignored.empty());
  imported.rig.cameras[0].time_offset_s = 0.0031;  // camera_info has no offset
  expectSame(imported.rig, replay::readRig(file("native.yaml", kNative)));
  EXPECT_THAT(errorOf({info, imu}, {T_BS, T_BS}), HasSubstr("--T_BS was given 2 times, and 1"));
}

TEST_F(RigImport, TwoSensorsOfEuRoCAreSeenFromTheIMU) {
  const std::string imu =
      "T_BS:\n  data: [1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nrate_hz: 200\n"
      "gyroscope_noise_density: 1e-4\ngyroscope_random_walk: 1e-5\n"
      "accelerometer_noise_density: 2e-3\naccelerometer_random_walk: 3e-3\n";
  std::string camera = kNative.substr(6, kNative.find("imu0:") - 6), flat;
  for (std::size_t i = 0; i < camera.size(); ++i) {  // removes two columns of indentation
    if (camera.compare(i, 2, "  ") == 0 && (i == 0 || camera[i - 1] == '\n'))
      ++i;
    else
      flat += camera[i];
  }
  const auto imported = importRig({file("cam.yaml", flat), file("imu.yaml", imu)});
  EXPECT_NEAR(imported.rig.cameras[0].T_BC.p.x(), 0.07 - 0.5, 1e-12);
  // A pose given in the IMU's frame is used unchanged.
  const auto given = importRig({file("ros.yaml", kCameraInfo), file("imu.yaml", imu)},
                               {transformOf("1 0 0 .05  0 1 0 0  0 0 1 0  0 0 0 1")});
  EXPECT_NEAR(given.rig.cameras[0].T_BC.p.x(), 0.05, 1e-12);
}

TEST_F(RigImport, DoubleSphereBecomesTheNearestEquidistantLens) {
  std::string chain = kChain;
  const auto replace = [&](const std::string& from, const std::string& to) {
    chain.replace(chain.find(from), from.size(), to);
  };
  replace("camera_model: pinhole", "camera_model: ds");
  replace("[458.654, 457.296, 367.215, 248.375]", "[-0.2345, 0.5694, 156.7, 156.7, 376, 240]");
  replace("[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]", "[]");
  replace("distortion_model: radtan", "distortion_model: none");
  const auto camera = importRig({file("chain.yaml", chain)}).rig.cameras[0];
  EXPECT_EQ(camera.distortion, DistortionModel::kEquidistant);
  EXPECT_NEAR(camera.fx, 156.7 / (1 - 0.2345), 2.0);  // near the axis: f/(1 + xi), for small alpha
  replace("camera_model: ds", "camera_model: scaramuzza");
  EXPECT_THAT(errorOf({file("chain.yaml", chain)}), HasSubstr("calibrate as pinhole-radtan"));
}

TEST_F(RigImport, WhatIsUnknownOrMissingIsToldByName) {
  EXPECT_THAT(importRig({file("chain.yaml", kChain + "  tilt: 3\ncam2:\n  x: 1\n")}).ignored,
              ElementsAre(HasSubstr("cam0: the key `tilt`"), HasSubstr("the key `cam2`")));
  EXPECT_THAT(errorOf({file("other.yaml", "colour: red\n")}),
              HasSubstr("has none of the keys cam0"));
  EXPECT_THAT(errorOf({file("imu.yaml", kKalibrImu)}), HasSubstr("no file has a camera"));
  const auto chain = file("chain.yaml", kChain);
  EXPECT_THAT(errorOf({chain, file("chain2.yaml", kChain), file("chain3.yaml", kChain)}),
              HasSubstr("is a third camera"));
  const auto imu = file("imu.yaml", kKalibrImu);
  EXPECT_THAT(errorOf({chain, imu, file("imu2.yaml", kKalibrImu)}), HasSubstr("is a second IMU"));
  EXPECT_THAT(errorOf({chain, file("scaled.yaml", "imu0:\n  model: scale-misalignment\n")}),
              HasSubstr("--imu-models calibrated"));
  EXPECT_THROW(transformOf("1 0 0 0"), StartupError);
  EXPECT_THROW(transformOf("1 0 0 x 0 1 0 0 0 0 1 0 0 0 0 1"), StartupError);
  EXPECT_THROW(transformOf("2 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"), StartupError);
}

}  // namespace
}  // namespace perdure::calibrate
