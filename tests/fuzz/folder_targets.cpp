// Targets: dataset folders. The text files are damaged or removed; images stay unchanged.
#include <cmath>
#include <fstream>

#include "common/replay/dataset.h"
#include "common/sim/truth.h"
#include "tests/common/replay/phone/tiny_phones.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace perdure::fuzz {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

const Names kEurocFiles{"mav0/cam0/data.csv",
                        "mav0/cam0/sensor.yaml",
                        "mav0/cam1/data.csv",
                        "mav0/cam1/sensor.yaml",
                        "mav0/imu0/data.csv",
                        "mav0/imu0/sensor.yaml",
                        "mav0/speed0/data.csv",
                        "mav0/speed0/sensor.yaml",
                        "mav0/state_groundtruth_estimate0/data.csv"};
const Names kRawFiles{"calib_cam_to_cam.txt",
                      "calib_velo_to_cam.txt",
                      "calib_imu_to_velo.txt",
                      "2011_09_26_drive_9999_sync/image_02/timestamps.txt",
                      "2011_09_26_drive_9999_sync/image_03/timestamps.txt",
                      "2011_09_26_drive_9999_sync/oxts/timestamps.txt",
                      "2011_09_26_drive_9999_sync/oxts/data/0000000000.txt",
                      "2011_09_26_drive_9999_sync/oxts/data/0000000001.txt"};
const Names kTrackingFiles{"calib/0000.txt", "calib/0001.txt", "label_02/0001.txt"};
const Names kSceneFiles{"sensor.yaml", "frame-000000.pose.txt", "frame-000001.pose.txt"};
const Names kMarsFiles{"gyro_accel.csv", "frame_timestamps.txt", "movie_metadata.csv"};
const Names kSpectacularFiles{"data.jsonl", "calibration.json"};
const Names kRecordFiles{"imu_data.jsonl", "camera_frames.jsonl"};
const Names kSensorLoggerFiles{"Gyroscope.csv", "Accelerometer.csv", "Gravity.csv", "Metadata.csv"};
const Names kTruthFiles{sim::kObjectsTruthFile, sim::kVisibilityTruthFile, sim::kInsideTruthFile};

/// Each folder is made once, in scratch(). The damaged files replace those of the seeds.
const fs::path& eurocFolder() {
  static const fs::path folder = [] {
    scratch();
    const fs::path made = replay::tinyEuroc("fuzz_euroc", true);
    replay::writeText(made / "mav0/speed0/data.csv",
                      "#timestamp [ns],speed\n1000000000,1.5\n1100000000,1.6\n");
    replay::writeText(made / "mav0/speed0/sensor.yaml", "sigma: 0.1\n");
    return made;
  }();
  return folder;
}
const fs::path& rawFolder() {
  static const fs::path folder = (scratch(), replay::tinyKittiRaw("fuzz_raw").parent_path());
  return folder;
}
const fs::path& trackingFolder() {
  static const fs::path folder = (scratch(), replay::tinyKittiTracking("fuzz_tracking"));
  return folder;
}

/// The images have a small camera of their own, because images of 640 × 480 pixels take long.
const fs::path& sceneFolder() {
  static const fs::path folder = [] {
    scratch();
    const fs::path made = replay::freshFolder("fuzz_scene");
    for (const char* number : {"0", "1"}) {
      const std::string frame = "frame-00000" + std::string(number);
      replay::writeImage(made / (frame + ".color.png"), 8, 6, 3);
      replay::writeDeepImage(made / (frame + ".depth.png"), 8, 6, 12);
      replay::writeText(made / (frame + ".pose.txt"),
                        "1 0 0 0." + std::string(number) + "\n0 1 0 2\n0 0 1 -3\n0 0 0 1\n");
    }
    replay::writeText(made / "sensor.yaml",
                      "up: [0.1, -0.9, -0.4]\nresolution: [8, 6]\nintrinsics: [7, 7, 4, 3]\n");
    return made;
  }();
  return folder;
}

const fs::path& marsFolder() {
  static const fs::path folder = (scratch(), replay::tinyMars("fuzz_mars"));
  return folder;
}
const fs::path& spectacularFolder() {
  static const fs::path folder = (scratch(), replay::tinySpectacular("fuzz_spectacular"));
  return folder;
}
const fs::path& recordFolder() {
  static const fs::path folder = (scratch(), replay::tinyRecords("fuzz_records"));
  return folder;
}
const fs::path& sensorLoggerFolder() {
  static const fs::path folder = (scratch(), replay::tinySensorLogger("fuzz_sensor_logger"));
  return folder;
}

TimePoint timeOf(const replay::Message& message) {
  if (const auto* frame = std::get_if<Frame>(&message)) return frame->stamp.time;
  if (const auto* imu = std::get_if<ImuSample>(&message)) return imu->time;
  return std::get<SpeedSample>(message).time;
}

void playThrough(const replay::DatasetOptions& options) {
  const auto dataset = replay::Dataset::open(options);
  constexpr int kMost = 500;
  TimePoint last = TimePoint::min();
  for (int i = 0; i < kMost; ++i) {
    const auto message = dataset->next();
    if (!message) break;
    require(timeOf(*message) >= last, "messages come by time");
    last = timeOf(*message);
    const auto* imu = std::get_if<ImuSample>(&*message);
    require(!imu || (imu->gyro.allFinite() && imu->accel.allFinite()), "samples are finite");
  }
  (void)dataset->frameAt(1);
  dataset->seek(1);
  (void)dataset->next();
}

bool takeFolder(View bytes, const fs::path& root, const Names& files,
                const replay::DatasetOptions& options) {
  unpack(bytes, root, files);
  return unlessRefused([&] { playThrough(options); });
}

bool takeTracking(View bytes) {
  const bool images = takeFolder(bytes, trackingFolder(), kTrackingFiles,
                                 {.path = trackingFolder(), .sequence = "0000"});
  const bool labels =
      unlessRefused([] { playThrough({.path = trackingFolder(), .sequence = "0001"}); });
  return images && labels;
}

bool takeScene(View bytes) {
  unpack(bytes, sceneFolder(), kSceneFiles);
  return unlessRefused([] {
    const replay::DatasetOptions options{.path = sceneFolder()};
    const auto dataset = replay::Dataset::open(options);
    require(dataset->truth().has_value(), "a scene has poses");
    for (const auto& pose : dataset->truth()->poses()) {
      require(pose.T_WB.p.allFinite() && std::abs(pose.T_WB.q.norm() - 1.0) < 1e-6,
              "a pose that was read is one");
    }
    playThrough(options);
  });
}

constexpr char kTruth[] =
    "=== objects_truth.json\n"
    R"({"objects": [{"id": 4, "class": "chair", "looks_like": "chair", "size": [0.5, 0.45, 0.9],
  "moves": true, "present_from_ns": 1000, "present_until_ns": 9000,
  "keys": [{"time_ns": 1000, "centre": [2, 0.3, 0.45], "yaw": 0.5},
           {"time_ns": 5000, "centre": [3, 0.3, 0.45], "yaw": -3.1}]}]})"
    "\n=== visibility_truth.csv\nframe,object_id,visible_fraction,x1,y1,x2,y2\n"
    "0,4,0.5,1,2,30,40\n1,4,1,1,2,31,40\n"
    "=== inside_truth.csv\nframe,object_id,x1,y1,x2,y2\n0,4,1,2,30,35\n";

bool takeTruth(View bytes) {
  const fs::path folder = scratch() / "truth";
  fs::create_directories(folder);
  unpack(bytes, folder, kTruthFiles);
  return unlessRefused([&] {
    const sim::Truth truth = sim::readTruth(folder);
    for (const auto& object : truth.objects) {
      require(!object.keys.empty(), "an object is somewhere");
      for (const std::int64_t ns : {std::int64_t{0}, std::int64_t{3000}, INT64_MAX}) {
        (void)object.at(fromNanoseconds(ns));
      }
    }
  });
}

}  // namespace

std::vector<Target> folderTargets() {
  const auto whole = [](const fs::path& (*folder)(), const Names& files) {
    return [folder, files] { return std::vector<Bytes>{pack(folder(), files)}; };
  };
  const auto euroc = [](View bytes) {
    return takeFolder(bytes, eurocFolder(), kEurocFiles, {.path = eurocFolder()});
  };
  const auto raw = [](View bytes) {
    return takeFolder(bytes, rawFolder(), kRawFiles,
                      {.path = rawFolder() / "2011_09_26_drive_9999_sync"});
  };
  const auto phone = [](const fs::path& (*folder)(), const Names& files) {
    return [folder, files](View bytes) {
      return takeFolder(bytes, folder(), files, {.path = folder(), .uncalibrated = true});
    };
  };
  return {
      {"mars", 300, whole(marsFolder, kMarsFiles), phone(marsFolder, kMarsFiles)},
      {"spectacular", 300, whole(spectacularFolder, kSpectacularFiles),
       phone(spectacularFolder, kSpectacularFiles)},
      {"sensor_records", 300, whole(recordFolder, kRecordFiles), phone(recordFolder, kRecordFiles)},
      {"sensor_logger", 300, whole(sensorLoggerFolder, kSensorLoggerFiles),
       phone(sensorLoggerFolder, kSensorLoggerFiles)},
      {"euroc", 2400, whole(eurocFolder, kEurocFiles), euroc},
      {"kitti_raw", 2400, whole(rawFolder, kRawFiles), raw},
      {"kitti_tracking", 2400, whole(trackingFolder, kTrackingFiles), takeTracking},
      {"seven_scenes", 2400, whole(sceneFolder, kSceneFiles), takeScene},
      {"simulated_truth", 4200, [] { return std::vector<Bytes>{bytesOf(kTruth)}; }, takeTruth}};
}

}  // namespace perdure::fuzz
