#include "tools/outputs/pictures/truth_sources.h"

#include <algorithm>
#include <cmath>

#include "common/base/algorithms/median.h"
#include "common/base/errors.h"
#include "common/math/so3.h"
#include "common/replay/files/kitti_calibration.h"
#include "tools/evaluate/object_truth.h"

namespace perdure::tools {
namespace {

/// Keeps only yaw and position, so that the vertical is unchanged.
RigidTransform level(const RigidTransform& T) {
  return RigidTransform(rotationAboutZ(yawOf(T.R())), T.p);
}

TruthTrack inWorld(const sim::TruthObject& object, const RigidTransform& T_WT) {
  TruthTrack track{object.id, object.class_name,   object.size,         object.moves,
                   {},        object.present_from, object.present_until};
  const double turn = yawOf(T_WT.R());
  for (const sim::TruthKey& key : object.keys) {
    track.keys.push_back({key.time, T_WT * key.centre_W, wrapAngle(key.yaw + turn)});
  }
  return track;
}

std::string classOf(const std::string& type) {
  if (type == "Pedestrian" || type == "Person" || type == "Person_sitting") return "person";
  std::string name = type;
  std::ranges::transform(name, name.begin(),
                         [](char c) { return static_cast<char>(std::tolower(c)); });
  return name;
}

/// Returns one key: the median of all positions, separately for each axis, with the mean yaw.
TruthTrack::Key middleOf(const std::vector<TruthTrack::Key>& keys) {
  TruthTrack::Key result = keys.front();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const auto& key : keys) values.push_back(key.centre_W[axis]);
    result.centre_W[axis] = medianOf(std::move(values));
  }
  double x = 0.0, y = 0.0;
  for (const auto& key : keys) x += std::cos(key.yaw), y += std::sin(key.yaw);
  result.yaw = std::atan2(y, x);
  return result;
}

}  // namespace

PictureTruth truthOfSimulation(const sim::Truth& truth, const replay::PoseFile& body,
                               const StampedPoses& poses) {
  PictureTruth picture;
  std::optional<RigidTransform> T_WT;
  for (const auto& [frame, pose] : poses) {
    const auto T_TB = body.at(frame, pose.time);
    if (!T_TB) continue;
    if (!T_WT) T_WT = level(pose.T_WB * T_TB->inverse());
    picture.path[frame] = *T_WT * T_TB->p;
  }
  if (!T_WT) return {};
  for (const auto& object : truth.objects) picture.objects.push_back(inWorld(object, *T_WT));
  return picture;
}

PictureTruth truthOfLabels(const std::vector<replay::KittiLabel>& labels,
                           const RigidTransform& T_RI, const StampedPoses& poses) {
  PosesByFrame by_frame;
  for (const auto& [frame, pose] : poses) by_frame[frame] = pose.T_WB;
  const auto standing = staticTracks(labels, T_RI, by_frame);
  std::map<std::int64_t, TruthTrack> tracks;
  for (const auto& label : labels) {
    const auto pose = poses.find(label.frame);
    if (label.dontCare() || pose == poses.end()) continue;
    const RigidTransform T_WR = pose->second.T_WB * T_RI.inverse();
    // KITTI's rotation_y is the angle about y from the camera's x axis to the object's front.
    const Eigen::Vector3d ahead_W =
        T_WR.q * Eigen::Vector3d(std::cos(label.rotation_y), 0.0, -std::sin(label.rotation_y));
    TruthTrack& track = tracks[label.track];
    track.id = static_cast<std::uint64_t>(label.track);
    track.class_name = classOf(label.type);
    track.size = {label.length, label.width, label.height};
    track.moves = !standing.contains(label.track);
    track.keys.push_back(
        {pose->second.time, T_WR * label.centre, std::atan2(ahead_W.y(), ahead_W.x())});
  }
  PictureTruth picture;
  for (auto& [id, track] : tracks) {
    if (!track.moves) track.keys = {middleOf(track.keys)};
    picture.objects.push_back(std::move(track));
  }
  return picture;
}

std::optional<PictureTruth> pictureTruthOfLabels(const std::filesystem::path& labels,
                                                 const std::filesystem::path& calibration,
                                                 const StampedPoses& poses) {
  if (!std::filesystem::exists(labels) || !std::filesystem::exists(calibration)) {
    return std::nullopt;
  }
  try {
    return truthOfLabels(replay::readKittiLabels(labels),
                         replay::readTrackingCalibration(calibration).T_RI, poses);
  } catch (const StartupError&) {
    return std::nullopt;
  }
}

std::optional<PictureTruth> pictureTruth(const replay::Dataset& dataset,
                                         const replay::DatasetOptions& data,
                                         const StampedPoses& poses) {
  if (dataset.kind() == replay::DatasetKind::kKittiTracking) {
    const std::string file = data.sequence + ".txt";
    return pictureTruthOfLabels(data.path / "label_02" / file, data.path / "calib" / file, poses);
  }
  if (!sim::hasTruth(data.path) || !dataset.truth()) return std::nullopt;
  try {
    return truthOfSimulation(sim::readTruth(data.path), *dataset.truth(), poses);
  } catch (const StartupError&) {
    return std::nullopt;
  }
}

}  // namespace perdure::tools
