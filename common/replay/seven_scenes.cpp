// 7-Scenes sequences (Shotton et al., CVPR 2013): frame-000000.color.png, .pose.txt and, for some
// frames, .depth.png in one folder; or color/000000.jpg, pose/000000.txt and depth/000000.png. A
// pose is that of the depth camera in the scene, 4×4.
// There are no stamps (30 Hz from t = 0 is assumed), no IMU and no gravity direction. The vertical
// comes from sensor.yaml, otherwise from the level planes of the depth images. W is the frame of
// the poses after the smallest rotation that makes z vertical. The body is the depth camera, x
// forward, y left, z up. Colour and depth come from two cameras and are not registered.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>

#include "common/base/algorithms/folder.h"
#include "common/base/errors.h"
#include "common/math/so3.h"
#include "common/replay/files/rig_file.h"
#include "common/replay/files/sensor_file.h"
#include "common/replay/files/text_file.h"
#include "common/replay/level_planes.h"
#include "common/replay/recording.h"
#include "common/vision/decode.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

constexpr double kRate_hz = 30.0;
constexpr std::uint32_t kWidth = 640, kHeight = 480;
// The authors give a focal length of 585 px, which is that of the depth camera, and no relative
// pose of the cameras. The colour images fit 525 px, as in DSAC* (Brachmann and Rother, PAMI 2021).
// In the red kitchen, depth points were compared with colour images 40 and 80 frames apart. The
// agreement is best at 518 px and a baseline of 23 mm; the baseline of a Kinect is 25 mm.
constexpr double kDepthFocal_px = 585.0, kFocal_px = 525.0, kBaseline_m = 0.025;
constexpr std::size_t kDepthImages = 25;
constexpr double kFarthest_m = 1e6;

TimePoint timeOf(std::size_t index) {
  return TimePoint(durationFromSeconds(static_cast<double>(index) / kRate_hz));
}

/// The files of one kind, by frame number.
using Numbered = std::map<std::size_t, fs::path>;

struct SceneFiles {
  Numbered colour, pose, depth;
};

/// Parses "frame-000012" or "000012".
std::optional<std::size_t> numberOf(std::string_view stem) {
  constexpr std::string_view kPrefix = "frame-";
  if (stem.starts_with(kPrefix)) stem.remove_prefix(kPrefix.size());
  if (stem.empty() || stem.size() > 9) return std::nullopt;
  if (stem.find_first_not_of("0123456789") != stem.npos) return std::nullopt;
  const auto number = parseInteger(stem);
  return number ? std::optional(static_cast<std::size_t>(*number)) : std::nullopt;
}

/// Files of the folder whose names are a frame number and one of `endings`.
Numbered filesOf(const fs::path& folder, const std::vector<std::string>& endings) {
  Numbered files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    for (const auto& ending : endings) {
      if (!name.ends_with(ending)) continue;
      const auto number = numberOf(std::string_view(name).substr(0, name.size() - ending.size()));
      if (number) files.emplace(*number, entry.path());
    }
  }
  return files;
}

bool hasFolders(const fs::path& folder) {
  return fs::is_directory(folder / "color") || fs::is_directory(folder / "pose");
}

SceneFiles filesOfSequence(const fs::path& folder) {
  if (hasFolders(folder)) {
    return {filesOf(folder / "color", {".png", ".jpg", ".jpeg"}),
            filesOf(folder / "pose", {".txt"}), filesOf(folder / "depth", {".png"})};
  }
  return {filesOf(folder, {".color.png", ".color.jpg", ".color.jpeg"}),
          filesOf(folder, {".pose.txt"}), filesOf(folder, {".depth.png"})};
}

bool holdsFrames(const fs::path& folder) {
  std::error_code ignored;
  return std::any_of(fs::directory_iterator(folder, ignored), fs::directory_iterator(),
                     [](const fs::directory_entry& entry) {
                       const std::string name = entry.path().filename().string();
                       return name.starts_with("frame-") &&
                              (name.ends_with(".pose.txt") || name.find(".color.") != name.npos);
                     });
}

std::vector<std::string> sequencesOf(const fs::path& scene) {
  std::vector<std::string> names;
  for (const fs::path& folder : pathsIn(scene, [](const fs::path& path) {
         return path.filename().string().starts_with("seq-") && fs::is_directory(path);
       })) {
    names.push_back(folder.filename().string());
  }
  return names;
}

/// The folder of the sequence: the given one, or the named sequence of a scene.
fs::path sequenceFolder(const DatasetOptions& options) {
  if (hasFolders(options.path) || holdsFrames(options.path)) return options.path;
  const auto names = sequencesOf(options.path);
  const bool known = std::find(names.begin(), names.end(), options.sequence) != names.end();
  if (known) return options.path / options.sequence;
  throw StartupError(ExitCode::kUsage,
                     "{} holds sequences of a scene: name one with --sequence ({})",
                     options.path.c_str(), fmt::join(names, ", "));
}

/// sensor.yaml of the sequence or of its scene. Returns nothing if there is none.
std::optional<SensorFile> sensorFileOf(const fs::path& folder) {
  const fs::path whole = fs::absolute(folder / "").lexically_normal().parent_path();
  for (const auto& place : {whole, whole.parent_path()}) {
    const bool of_scene = place != whole;
    if (of_scene && sequencesOf(place).empty()) continue;
    if (fs::exists(place / "sensor.yaml")) return SensorFile(place / "sensor.yaml");
  }
  return std::nullopt;
}

/// T_BD, the pose of the depth camera D in the body.
RigidTransform depthInBody() {
  Eigen::Matrix3d R_BD;
  R_BD << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return RigidTransform(R_BD, Eigen::Vector3d::Zero());
}

RigidTransform colourInBody() {
  const Eigen::Vector3d p_DC(kBaseline_m, 0.0, 0.0);
  return depthInBody() * RigidTransform(Eigen::Quaterniond::Identity(), p_DC);
}

CameraCalibration depthCamera() {
  CameraCalibration camera;
  camera.width = kWidth, camera.height = kHeight;
  camera.fx = camera.fy = kDepthFocal_px;
  camera.cx = kWidth / 2.0, camera.cy = kHeight / 2.0;
  return camera;
}

/// The camera from the rig file, otherwise from sensor.yaml if it contains a lens, otherwise with
/// the known values of the Kinect.
CameraCalibration cameraOf(const std::optional<SensorFile>& sensor, const DatasetOptions& options,
                           const fs::path& first_image) {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.rate_hz = kRate_hz;
  camera.T_BC = colourInBody();
  if (!options.rig.empty()) {
    const Calibration rig = readRig(options.rig);
    if (const auto* in_rig = rig.camera(camera.name)) return *in_rig;
  }
  if (sensor && (sensor->has("intrinsics") || sensor->has("camera_matrix"))) {
    camera = readCamera(*sensor, camera.name, camera.T_BC);
    if (camera.rate_hz == 0.0) camera.rate_hz = kRate_hz;
    return camera;
  }
  const auto image = vision::decodeImageFile(first_image.string(), std::nullopt);
  if (image && (image->cols != int{kWidth} || image->rows != int{kHeight})) {
    throw StartupError(
        ExitCode::kUnavailable,
        first_image.string() + " is " + std::to_string(image->cols) + "x" +
            std::to_string(image->rows) +
            ", and of 7-Scenes only the lens of 640x480 images is known; write sensor.yaml in the "
            "folder, with resolution: [width, height] and intrinsics: [fx, fy, cx, cy]");
  }
  camera.width = kWidth, camera.height = kHeight;
  camera.fx = camera.fy = kFocal_px;
  camera.cx = kWidth / 2.0, camera.cy = kHeight / 2.0;
  return camera;
}

/// The pose of the camera in the frame P of the poses. Returns nothing if tracking was lost
/// (numbers that are not finite), which is counted; other errors are added to `wrong`.
std::optional<RigidTransform> readPose(const fs::path& file, Complaints& wrong,
                                       ReasonCounts& reasons) {
  std::vector<double> v;
  const auto is_lost = [](const std::string& text) {
    const std::string lower = toLower(text);
    return lower.find("inf") != lower.npos || lower.find("nan") != lower.npos;
  };
  const auto complain = [&](const std::string& what) {
    wrong.add(file.string() + ": " + what);
    return std::nullopt;
  };
  for (const auto& line : readLines(file, "each frame has a pose file")) {
    if (is_lost(line.text)) {
      reasons.add("pose_lost");
      return std::nullopt;
    }
    const auto numbers = parseNumbers(split(line.text, ' '));
    if (!numbers) return complain("line " + std::to_string(line.number) + " is not of numbers");
    v.insert(v.end(), numbers->begin(), numbers->end());
  }
  if (v.size() != 16) {
    return complain(std::to_string(v.size()) + " numbers, where a pose has 16 (4x4, row by row)");
  }
  const auto T = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(v.data());
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  if (!isRotation(R)) return complain("the rotation is not orthonormal and right-handed");
  if (!T.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), 1e-6)) {
    return complain("the last row of a pose is 0 0 0 1");
  }
  const Eigen::Vector3d p = T.topRightCorner<3, 1>();
  if (!(p.cwiseAbs().maxCoeff() <= kFarthest_m)) {
    return complain("the camera is more than 1000 km away; poses are in metres");
  }
  return RigidTransform(R, p);
}

/// Returns T_PC by frame. Throws StartupError if a file is invalid.
std::map<std::size_t, RigidTransform> readPoses(const SceneFiles& files, Recording& recording) {
  std::map<std::size_t, RigidTransform> poses;
  Complaints wrong;
  for (const auto& [index, image] : files.colour) {
    const auto file = files.pose.find(index);
    if (file == files.pose.end()) {
      recording.reasons.add("pose_missing");
      continue;
    }
    if (const auto pose = readPose(file->second, wrong, recording.reasons)) {
      poses.emplace(index, *pose);
    }
  }
  wrong.throwIfAny();
  return poses;
}

Eigen::Vector3d meanCameraUp(const std::map<std::size_t, RigidTransform>& poses) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [index, T_PC] : poses) sum += T_PC.q * -Eigen::Vector3d::UnitY();
  return sum;
}

[[noreturn]] void throwNoGravity(const fs::path& folder, const std::string& why) {
  throw StartupError(ExitCode::kUnavailable,
                     folder.string() + ": which way is up is not known (" + why +
                         "); write sensor.yaml in the folder with up: [x, y, z], the direction "
                         "against gravity in the frame of the poses");
}

UpEstimate estimateUp(const fs::path& folder, const SceneFiles& files,
                      const std::map<std::size_t, RigidTransform>& poses) {
  std::vector<std::pair<fs::path, Eigen::Matrix3d>> views;
  for (const auto& [index, file] : files.depth) {
    const auto pose = poses.find(index);
    if (pose != poses.end()) views.emplace_back(file, pose->second.R());
  }
  if (views.empty()) throwNoGravity(folder, "no depth image has a pose");
  LevelPlanes planes;
  const std::size_t used = std::min(views.size(), kDepthImages);
  for (std::size_t i = 0; i < used; ++i) {
    const auto& [file, R_PC] = views[i * views.size() / used];
    const auto depth = vision::decodeDepthFile(file.string());
    if (!depth) throwNoGravity(folder, depth.error().detail);
    if (depth->cols != int{kWidth} || depth->rows != int{kHeight}) {
      throwNoGravity(folder, file.string() + " is not of 640x480, whose lens is known");
    }
    planes.add(*depth, depthCamera(), R_PC);
  }
  const auto up = planes.up(meanCameraUp(poses));
  if (!up) throwNoGravity(folder, up.error().detail);
  return *up;
}

/// Returns the unit vector against gravity in the frame of the poses: from sensor.yaml, otherwise
/// from level planes.
Eigen::Vector3d upOf(const fs::path& folder, const std::optional<SensorFile>& sensor,
                     const SceneFiles& files, const std::map<std::size_t, RigidTransform>& poses,
                     Recording& recording) {
  if (sensor && sensor->has("up")) {
    const auto v = sensor->numbers("up", 3);
    const Eigen::Vector3d up(v[0], v[1], v[2]);
    if (!(up.stableNorm() > 1e-6)) sensor->wrong("up", "is no direction");
    return up.stableNormalized();
  }
  const UpEstimate estimate = estimateUp(folder, files, poses);
  recording.notes.push_back(fmt::format(
      "gravity is not given and was taken from level planes of the depth images: up is "
      "[{:.4f}, {:.4f}, {:.4f}] in the poses' frame ({} of {} patches)",
      estimate.up.x(), estimate.up.y(), estimate.up.z(), estimate.patches, estimate.all));
  return estimate.up;
}

PoseFile truthOf(const std::map<std::size_t, RigidTransform>& poses, const Eigen::Vector3d& up_P) {
  const RigidTransform T_DB = depthInBody().inverse();
  const RigidTransform T_WP(Eigen::Quaterniond::FromTwoVectors(up_P, Eigen::Vector3d::UnitZ()),
                            Eigen::Vector3d::Zero());
  std::vector<StampedPose> stamped;
  for (const auto& [index, T_PD] : poses) {
    stamped.push_back({timeOf(index), T_WP * T_PD * T_DB});
  }
  return PoseFile(PoseFormat::kTum, std::move(stamped));
}

}  // namespace

bool looksLikeSevenScenes(const fs::path& folder) {
  return (fs::is_directory(folder / "color") && fs::is_directory(folder / "pose")) ||
         holdsFrames(folder) || !sequencesOf(folder).empty();
}

Recording readSevenScenes(const DatasetOptions& options) {
  const fs::path folder = sequenceFolder(options);
  const SceneFiles files = filesOfSequence(folder);
  if (files.colour.empty()) {
    throwMissing(folder / "frame-000000.color.png", "any colour image",
                 "a 7-Scenes sequence has them by number, there or as color/000000.png");
  }
  Recording recording;
  recording.kind = DatasetKind::kSevenScenes;
  const auto sensor = sensorFileOf(folder);
  const CameraCalibration camera = cameraOf(sensor, options, files.colour.begin()->second);
  recording.calibration.cameras.push_back(camera);
  recording.frame_count = files.colour.rbegin()->first + 1;
  for (const auto& [index, image] : files.colour) {
    recording.frames.push_back({timeOf(index), index, 0, image.string()});
  }
  const auto poses = readPoses(files, recording);
  if (poses.empty()) {
    throwMissing(folder / "frame-000000.pose.txt", "the pose of any frame",
                 "a 7-Scenes sequence has one for each colour image, there or as pose/000000.txt");
  }
  const Eigen::Vector3d up = upOf(folder, sensor, files, poses, recording);
  recording.truth = truthOf(poses, up);
  if (sensor) sensor->noteUnknownKeys(recording.notes);
  return recording;
}

}  // namespace perdure::replay
