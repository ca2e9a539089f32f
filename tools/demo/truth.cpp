#include "tools/demo/truth.h"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "common/base/algorithms/median.h"
#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/replay/dataset.h"
#include "common/replay/files/kitti_calibration.h"
#include "common/replay/files/kitti_labels.h"
#include "common/replay/files/pose_file.h"
#include "tools/evaluate/object_report.h"
#include "tools/evaluate/object_score.h"
#include "tools/evaluate/simulated_truth.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Name of the tracking sequence with the frames of a raw drive; empty if there is none.
std::string trackingSequenceOf(const fs::path& drive) {
  return drive.filename() == "2011_09_26_drive_0005_sync" ? "0000" : "";
}

TruthFiles filesOf(const fs::path& root, const std::string& sequence) {
  return {root / "label_02" / (sequence + ".txt"), root / "calib" / (sequence + ".txt"), sequence};
}

bool complete(const TruthFiles& files) {
  return !files.sequence.empty() && fs::exists(files.labels) && fs::exists(files.calibration);
}

/// Median position in W over all labels of a static car, computed separately for each axis.
Eigen::Vector3d middleOf(const std::vector<replay::KittiLabel>& labels, std::int64_t track,
                         const PosesByFrame& poses, const RigidTransform& T_RI) {
  std::array<std::vector<double>, 3> values;
  for (const auto& label : labels) {
    const auto pose = poses.find(label.frame);
    if (label.track != track || pose == poses.end()) continue;
    const Eigen::Vector3d p_W = pose->second * (T_RI.inverse() * label.centre);
    for (std::size_t i = 0; i < 3; ++i) values[i].push_back(p_W[static_cast<Eigen::Index>(i)]);
  }
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    middle[static_cast<Eigen::Index>(i)] = medianOf(std::move(values[i]));
  }
  return middle;
}

/// Each counted track of a car, with the nearest of `rows`: final estimates, one per object.
Json parkedCars(const std::vector<replay::KittiLabel>& labels, const std::set<std::int64_t>& tracks,
                const PosesByFrame& poses, const RigidTransform& T_RI,
                const std::vector<EstimateRow>& rows) {
  Json cars = Json::array();
  for (const std::int64_t track : tracks) {
    const bool car = std::ranges::any_of(
        labels, [&](const auto& label) { return label.track == track && label.type == "Car"; });
    if (!car) continue;
    const Eigen::Vector3d truth = middleOf(labels, track, poses, T_RI);
    double nearest = std::numeric_limits<double>::infinity();
    std::uint64_t id = 0;
    for (const EstimateRow& row : rows) {
      const double distance = (row.centre_W - truth).norm();
      if (distance < nearest) nearest = distance, id = row.id;
    }
    Json one = {{"track", track}, {"position_m", {truth.x(), truth.y(), truth.z()}}};
    if (id != 0) one["nearest_object"] = {{"id", id}, {"distance_m", nearest}};
    cars.push_back(one);
  }
  return cars;
}

Json toJson(const sim::TruthObject& object) {
  Json keys = Json::array();
  for (const sim::TruthKey& key : object.keys) {
    const Eigen::Vector3d& p = key.centre_W;
    keys.push_back({toSeconds(key.time), p.x(), p.y(), p.z(), key.yaw});
  }
  return {{"id", object.id},
          {"class", object.class_name},
          {"size", {object.size.x(), object.size.y(), object.size.z()}},
          {"from", toSeconds(object.present_from)},
          {"until", toSeconds(object.present_until)},
          {"moves", object.moves},
          {"keys", keys}};
}

}  // namespace

std::optional<TruthFiles> findTruth(const DemoOptions& options) {
  const fs::path drive = fs::weakly_canonical(fs::absolute(options.data));
  std::string sequence = options.truth_sequence;
  if (sequence.empty()) {
    sequence = options.sequence.empty() ? trackingSequenceOf(drive) : options.sequence;
  }
  if (!options.truth.empty()) {
    const TruthFiles files = filesOf(options.truth, sequence);
    if (complete(files)) return files;
    throw StartupError(ExitCode::kUnavailable,
                       options.truth + " has no label_02 and calib of sequence \"" + sequence +
                           "\"; give --truth the root of KITTI tracking and --truth-sequence");
  }
  if (complete(filesOf(drive, sequence))) return filesOf(drive, sequence);
  for (fs::path folder = drive; folder != folder.root_path(); folder = folder.parent_path()) {
    const TruthFiles files = filesOf(folder.parent_path() / "kitti_tracking", sequence);
    if (complete(files)) return files;
  }
  return std::nullopt;
}

Json scoreAgainst(const TruthFiles& truth, const fs::path& out) {
  const fs::path copy = out / "truth";
  fs::create_directories(copy / "label_02");
  fs::create_directories(copy / "calib");
  constexpr auto kReplace = fs::copy_options::overwrite_existing;
  fs::copy_file(truth.labels, copy / "label_02" / truth.labels.filename(), kReplace);
  fs::copy_file(truth.calibration, copy / "calib" / truth.calibration.filename(), kReplace);

  const auto labels = replay::readKittiLabels(truth.labels);
  auto calibration = replay::readTrackingCalibration(truth.calibration);
  const auto size = replay::trackingImageSize(truth.sequence);
  calibration.width = size.width;
  calibration.height = size.height;
  auto rows = readObjectRows(out / "objects_final.csv");
  const auto poses = posesByFrame(replay::PoseFile::read(out / "trajectory.tum").poses(), rows);
  std::erase_if(rows, [](const EstimateRow& row) { return row.class_name != "car"; });
  const auto tracks = staticTracks(labels, calibration.T_RI, poses);
  const auto score = scoreObjects(rows, sortTruth(labels, tracks), poses, calibration, {});
  Json report = toReport(score);
  report["of"] =
      "cars in objects_final.csv, under 1 m, any orientation; duplicates are objects of "
      "the map for each true one that was found";
  report["parked_cars"] = parkedCars(labels, tracks, poses, calibration.T_RI, rows);
  return report;
}

bool writeTruthForPage(const fs::path& drive, const fs::path& file) {
  const auto dataset = replay::Dataset::open({.path = drive, .decode = false});
  if (!lackOfTruth(drive, *dataset).empty()) return false;
  Json truth = {{"path", Json::array()}, {"objects", Json::array()}};
  for (std::uint64_t i = 0; i < dataset->frameCount(); ++i) {
    const auto time = dataset->frameTime(i);
    const auto body = time ? dataset->truth()->at(i, *time) : std::nullopt;
    if (!body) continue;
    const auto& [q, p] = std::pair(body->q, body->p);
    truth["path"].push_back({toSeconds(*time), p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()});
  }
  for (const auto& object : sim::readTruth(drive).objects) {
    truth["objects"].push_back(toJson(object));
  }
  writeChecked(file, truth.dump());
  return true;
}

}  // namespace perdure::tools
