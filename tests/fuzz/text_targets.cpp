// Targets: text and YAML files of tools and datasets. They are poses, detections, labels, rows and
// rigs.
#include <cmath>

#include "common/replay/files/boxes/detection_file.h"
#include "common/replay/files/class_aliases.h"
#include "common/replay/files/kitti_calibration.h"
#include "common/replay/files/kitti_labels.h"
#include "common/replay/files/pose_file.h"
#include "common/replay/files/rig_file.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"
#include "tools/evaluate/memory/places.h"
#include "tools/evaluate/object_rows.h"

namespace perdure::fuzz {
namespace {

constexpr char kTum[] =
    "# t x y z qx qy qz qw\n1.5 0 0 0 0 0 0 1\n1.75 1 2 3 0 0 0.6 0.8\n2.5 1 2 4 0 0 0 1\n";
constexpr char kKitti12[] = "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.5 0 1 0 0 0 0 1 0\n";
constexpr char kKitti16[] = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n";

constexpr char kSteps[] =
    "# t x y z qx qy qz qw step_x_x step_y_y step_z_z step_rx_rx step_ry_ry step_rz_rz step_x_rz\n"
    "1.5 0 0 0 0 0 0 1 1e-4 1e-4 1e-4 1e-6 1e-6 1e-6 1e-5\n"
    "1.75 1 2 3 0 0 0.6 0.8 1e-4 1e-4 1e-4 1e-6 1e-6 1e-6 -1e-5\n";

bool takePoses(View bytes) {
  return unlessRefused([&] {
    const auto file = replay::PoseFile::read(asFile("poses.txt", bytes));
    for (const auto& pose : file.poses()) {
      require(pose.T_WB.p.allFinite() && std::abs(pose.T_WB.q.norm() - 1.0) < 1e-6,
              "a pose that was read is one");
    }
    (void)file.at(1, fromNanoseconds(1'600'000'000));
    if (!file.poses().empty()) (void)file.at(0, file.poses().back().time);
    if (!file.hasSteps()) return;
    FrameStamp first, last;
    first.time = file.poses().front().time, last.time = file.poses().back().time;
    last.sequence = file.poses().size() - 1;
    (void)file.errorOfSteps(first, last);
  });
}

constexpr char kDetections[] =
    "frame,class,x1,y1,x2,y2,score,alpha\n0,Car,10,20,60,70,0.9,0.5\n2,Van,1,2,30.5,40,1.0,-3\n";
constexpr char kLogits[] =
    "frame,class,x1,y1,x2,y2,score,logit:car,logit:van,sigma_x1,sigma_y1,sigma_x2,sigma_y2\n"
    "0,car,10,20,60,70,0.9,2.5,-1,1,2,0,4\n";
constexpr char kRrc[] = "0,10,20,60,70,0.9\n3,10,20,60,70,0.1\n";
const std::vector<std::string> kDetectionFiles{"d.csv", "d.frames"};

bool takeDetections(View bytes) {
  unpack(bytes, scratch(), kDetectionFiles);
  return unlessRefused([] {
    const auto file = replay::DetectionFile::read(
        {.file = scratch() / "d.csv", .class_name = "Car", .box_origin = 1.0}, {});
    for (const std::uint64_t frame : {std::uint64_t{0}, std::uint64_t{2}, file.lastFrame()}) {
      const auto model = file.modelAt(frame);
      const auto detections = file.at(frame);
      if (!detections) continue;
      for (const auto& d : *detections) {
        require(d.activations.size() == model.classes.size() + 1, "an activation for each class");
        require(std::isfinite(d.box.x1 + d.box.y1 + d.box.x2 + d.box.y2), "a box is finite");
      }
    }
  });
}

constexpr char kLabels[] =
    "0 3 Car 0 0 -1.5 10 20 60 70 1.5 1.6 4.0 1.0 1.65 10.0 -1.57\n"
    "4 -1 DontCare -1 -1 -10 1 2 3 4 -1000 -1000 -1000 -10 -1 -1 -1\n";

bool takeLabels(View bytes) {
  return unlessRefused([&] {
    for (const auto& label : replay::readKittiLabels(asFile("labels.txt", bytes))) {
      require(label.centre.allFinite() && std::isfinite(label.rotation_y), "a label is finite");
    }
  });
}

constexpr char kCalibration[] =
    "P0: 700 0 24 0 0 700 8 0 0 0 1 0\nP1: 700 0 24 -370 0 700 8 0 0 0 1 0\n"
    "P2: 700 0 24 42 0 700 8 0.7 0 0 1 0\nP3: 700 0 24 -336 0 700 8 0.7 0 0 1 0\n"
    "R0_rect: 1 0 0 0 1 0 0 0 1\nTr_velo_to_cam: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3\n"
    "Tr_imu_to_velo: 1 0 0 -0.8 0 1 0 0.3 0 0 1 -0.8\n";

bool takeCalibration(View bytes) {
  return unlessRefused([&] {
    const auto calibration = replay::readTrackingCalibration(asFile("calib.txt", bytes));
    for (const char* name : {"cam0", "cam1"}) {
      const auto camera = calibration.camera(name);
      require(camera.T_BC.p.allFinite() && std::abs(camera.T_BC.q.norm() - 1.0) < 1e-6,
              "a camera stands somewhere");
    }
  });
}

constexpr char kRows[] =
    "sequence,frame,timestamp_ns,object_id,class,score,x,y,z,l,w,h,yaw,visible\n"
    "0000,3,300000000,12,Car,0.9,1,2,3,4,1.6,1.5,0.25,1\n"
    "0000,5,500000000,13,van,0.7,1,2,3,4,1.6,1.5,-1,1\n";

bool takeRows(View bytes) {
  return unlessRefused([&] {
    const auto rows = tools::readObjectRows(asFile("rows.csv", bytes));
    for (const auto& row : rows) {
      require(row.centre_W.allFinite() && std::isfinite(row.yaw + row.length), "a row is finite");
    }
    std::vector<replay::StampedPose> poses;
    for (const int tenths : {2, 3, 4, 5, 8}) {
      poses.push_back({fromNanoseconds(tenths * 100'000'000LL + 3), {}});
    }
    require(tools::posesByFrame(poses, rows).size() <= poses.size(), "no pose comes from nowhere");
  });
}

constexpr char kPlaces[] = "place,visit,x,y,z,frames\n0,0,-4,1,25.5,8 9 10\n0,1,-4.25,1,25,90 91\n";

bool takePlaces(View bytes) {
  return unlessRefused([&] {
    for (const auto& [place, visits] : tools::readPlaces(asFile("places.csv", bytes))) {
      for (const auto& [number, visit] : visits) {
        require(!visit.frames.empty() && visit.position.allFinite(), "a visit has frames");
      }
    }
  });
}

constexpr char kRig[] =
    "cam0:\n  T_BS: {cols: 4, rows: 4, data: [0, 0, 1, 0.1, -1, 0, 0, 0.2, 0, -1, 0, 0.3, "
    "0, 0, 0, 1]}\n  rate_hz: 20\n  resolution: [32, 24]\n  camera_model: pinhole\n"
    "  intrinsics: [20.0, 21.0, 16.0, 12.0]\n  distortion_model: radial-tangential\n"
    "  distortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]\n  time_offset_s: 0.01\n"
    "imu0:\n  T_BS: {cols: 4, rows: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}\n"
    "  rate_hz: 200\n  gyroscope_noise_density: 1.7e-04\n  gyroscope_random_walk: 1.9e-05\n"
    "  accelerometer_noise_density: 2.0e-3\n  accelerometer_random_walk: 3.0e-3\n";

constexpr char kCamchain[] =
    "cam0:\n  T_cam_imu:\n  - [0, -1, 0, 0.1]\n  - [0, 0, -1, 0]\n  - [1, 0, 0, 0]\n"
    "  - [0, 0, 0, 1]\n  camera_model: omni\n  distortion_model: radtan\n"
    "  distortion_coeffs: [-0.1, 0.01, 0.0001, 0.0002]\n  intrinsics: [1.2, 25, 25, 16, 12]\n"
    "  resolution: [32, 24]\n  rostopic: /cam0/image_raw\n  timeshift_cam_imu: 0.01\n"
    "cam1:\n  T_cn_cnm1:\n  - [1, 0, 0, -0.1]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n"
    "  - [0, 0, 0, 1]\n  camera_model: ds\n  distortion_model: none\n"
    "  intrinsics: [-0.2, 0.6, 20, 20, 16, 12]\n  resolution: [32, 24]\n";
constexpr char kEucm[] =
    "cam0:\n  T_BS: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n  camera_model: eucm\n"
    "  intrinsics: [0.6, 1.1, 20, 20, 16, 12]\n  resolution: [32, 24]\n";

bool takeRig(View bytes) {
  return unlessRefused([&] {
    const Calibration rig = replay::readRig(asFile("rig.yaml", bytes));
    for (const auto& camera : rig.cameras) {
      require(camera.T_BC.p.allFinite() && std::abs(camera.T_BC.q.norm() - 1.0) < 1e-6,
              "a camera stands somewhere");
      require(std::isfinite(camera.fx + camera.fy + camera.cx + camera.cy), "a lens is finite");
    }
    const std::string text = replay::rigText(rig, "again");
    const Calibration again = replay::readRig(asFile("rig_again.yaml", bytesOf(text)));
    require(again.cameras.size() == rig.cameras.size(), "a rig reads back what it wrote");
  });
}

constexpr char kAliases[] = "car: [Car, automobile]\nperson: [pedestrian, \"Person sitting\"]\n";

bool takeAliases(View bytes) {
  return unlessRefused([&] {
    const auto aliases = replay::ClassAliases::load(asFile("aliases.yaml", bytes));
    const std::string name = aliases.canonical("Car");
    require(aliases.canonical(name) == name || !name.empty(), "a class has a name");
  });
}

}  // namespace

std::vector<Target> textTargets() {
  const auto alone = [](std::initializer_list<std::string_view> texts) {
    return [list = std::vector<std::string_view>(texts)] {
      std::vector<Bytes> seeds;
      for (const auto text : list) seeds.push_back(bytesOf(text));
      return seeds;
    };
  };
  const auto detections = [] {
    std::vector<Bytes> seeds;
    for (const std::string text : {kDetections, kLogits, kRrc}) {
      seeds.push_back(bytesOf("=== d.csv\n" + text));
      seeds.push_back(bytesOf("=== d.csv\n" + text + "=== d.frames\n0\n2\n"));
    }
    return seeds;
  };
  return {{"poses", 9000, alone({kTum, kKitti12, kKitti16, kSteps}), takePoses},
          {"detections", 9000, detections, takeDetections},
          {"kitti_labels", 6000, alone({kLabels}), takeLabels},
          {"kitti_calibration", 6000, alone({kCalibration}), takeCalibration},
          {"object_rows", 6000, alone({kRows}), takeRows},
          {"places", 6000, alone({kPlaces}), takePlaces},
          {"rig", 4200, alone({kRig, kCamchain, kEucm}), takeRig},
          {"class_aliases", 6000, alone({kAliases}), takeAliases}};
}

}  // namespace perdure::fuzz
