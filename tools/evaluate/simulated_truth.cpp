#include "tools/evaluate/simulated_truth.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "common/base/errors.h"
#include "common/math/so3.h"
#include "common/types/objects.h"

namespace perdure::tools {
namespace {

constexpr double kWhollySeen = 0.9;
constexpr char kToy[] = "toy";

/// Transforms points from W to the camera, and yaws from W to the body's heading.
struct Eye {
  RigidTransform T_CW;
  double heading = 0.0;

  Eye(const RigidTransform& T_WB, const CameraModel& camera)
      : T_CW((T_WB * camera.T_BC()).inverse()), heading(yawOf(T_WB.R())) {}
};

Box cutAtImage(const Box& box, const CameraModel& camera) {
  const double w = camera.width(), h = camera.height();
  return {std::clamp(box.x1, 0.0, w), std::clamp(box.y1, 0.0, h), std::clamp(box.x2, 0.0, w),
          std::clamp(box.y2, 0.0, h)};
}

bool insideImage(const Box& box, const CameraModel& camera) {
  return box.x1 >= 0 && box.y1 >= 0 && box.x2 <= camera.width() && box.y2 <= camera.height();
}

/// Box around the corners that can be projected, clipped to the image. If none can be projected,
/// the box is around the centre.
Box boxOf(const EstimateRow& row, const Eye& eye, const CameraModel& camera) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Box box{kInfinity, kInfinity, -kInfinity, -kInfinity};
  const Eigen::Vector3d size(row.length, row.width, row.height);
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d half(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5,
                               corner & 4 ? 0.5 : -0.5);
    const Eigen::Vector3d offset = rotationAboutZ(row.yaw) * half.cwiseProduct(size);
    const auto pixel = camera.project(eye.T_CW * (row.centre_W + offset));
    if (!pixel) continue;
    box.x1 = std::min(box.x1, pixel->x()), box.x2 = std::max(box.x2, pixel->x());
    box.y1 = std::min(box.y1, pixel->y()), box.y2 = std::max(box.y2, pixel->y());
  }
  return box.x1 <= box.x2 ? cutAtImage(box, camera) : Box{};
}

std::optional<Estimate> estimateOf(const EstimateRow& row, const Eye& eye,
                                   const CameraModel& camera) {
  Estimate estimate;
  estimate.id = row.id;
  estimate.class_name = row.class_name;
  estimate.centre = eye.T_CW * row.centre_W;
  const auto pixel = camera.project(estimate.centre);
  if (!pixel || !camera.inImage(*pixel)) return std::nullopt;
  estimate.heading = wrapAngle(row.yaw - eye.heading);
  estimate.box = boxOf(row, eye, camera);
  return estimate;
}

TruthFrame labelsOf(const SimulatedTruth& truth, std::uint64_t frame,
                    const std::string& class_name) {
  TruthFrame labels;
  const TimePoint time = truth.frames[frame];
  const auto views = truth.truth.views.find(frame);
  const auto body = truth.body.at(frame, time);
  if (views == truth.truth.views.end() || !body) return labels;
  const Eye eye(*body, truth.camera);
  for (const auto& view : views->second) {
    const auto object =
        std::ranges::find(truth.truth.objects, view.object_id, &sim::TruthObject::id);
    if (object == truth.truth.objects.end() || object->class_name == kToy) continue;
    const sim::TruthKey key = object->at(time);
    const bool counts = (class_name.empty() || object->class_name == class_name) &&
                        !object->moves && object->keys.size() == 1 &&
                        view.visible_fraction >= kWhollySeen &&
                        insideImage(view.box, truth.camera) && view.box.height() >= kMinHeight_px;
    (counts ? labels.counted : labels.ignored)
        .push_back({static_cast<std::int64_t>(object->id), object->class_name,
                    eye.T_CW * key.centre_W, wrapAngle(key.yaw - eye.heading),
                    cutAtImage(view.box, truth.camera)});
  }
  return labels;
}

}  // namespace

double SimulatedTruth::frameInterval() const {
  if (frames.size() < 2) return 0.1;
  return toSeconds(frames.back() - frames.front()) / static_cast<double>(frames.size() - 1);
}

bool isSimulated(const std::filesystem::path& folder) { return sim::hasTruth(folder); }

std::string lackOfTruth(const std::filesystem::path& folder, const replay::Dataset& dataset) {
  const char* file = !dataset.truth() ? "mav0/state_groundtruth_estimate0/data.csv"
                     : !std::filesystem::exists(folder / "visibility_truth.csv")
                         ? "visibility_truth.csv"
                         : nullptr;
  if (!file) return {};
  return fmt::format(
      "{} lacks {}, a part of the truth; make the folder again with perdure simulate",
      folder.c_str(), file);
}

SimulatedTruth readSimulatedTruth(const std::filesystem::path& folder) {
  if (!isSimulated(folder)) {
    throw StartupError(ExitCode::kUnavailable,
                       folder.string() +
                           " holds no objects_truth.json; name a folder that `perdure simulate "
                           "--out` made, or with --sequence a root of KITTI tracking");
  }
  const auto dataset = replay::Dataset::open({.path = folder, .decode = false});
  if (const auto lack = lackOfTruth(folder, *dataset); !lack.empty())
    throw StartupError(ExitCode::kUnavailable, lack);
  SimulatedTruth truth{sim::readTruth(folder),
                       *dataset->truth(),
                       CameraModel(dataset->calibration().cameras.front()),
                       {}};
  for (std::uint64_t i = 0; i < dataset->frameCount(); ++i) {
    if (const auto time = dataset->frameTime(i)) truth.frames.push_back(*time);
  }
  return truth;
}

SimulatedRun pairWithTruth(const SimulatedTruth& truth, const std::vector<EstimateRow>& rows,
                           const std::vector<replay::StampedPose>& trajectory,
                           const std::string& class_name) {
  SimulatedRun run;
  std::map<TimePoint, RigidTransform> pose_at;
  for (const auto& pose : trajectory) pose_at[pose.time] = pose.T_WB;
  std::map<std::uint64_t, Eye> eyes;
  for (std::uint64_t i = 0; i < truth.frames.size(); ++i) {
    if (pose_at.empty() || truth.frames[i] > pose_at.rbegin()->first) break;
    run.frames[i].truth = labelsOf(truth, i, class_name);
    const auto pose = pose_at.find(truth.frames[i]);
    if (pose != pose_at.end()) eyes.emplace(i, Eye(pose->second, truth.camera));
  }
  run.poses = eyes.size();
  for (const auto& row : rows) {
    const bool asked =
        class_name.empty() ? row.class_name != kOtherClass : row.class_name == class_name;
    if (!asked) continue;
    ++run.estimates;
    const auto eye = eyes.find(row.frame);
    const auto estimate =
        eye == eyes.end() ? std::nullopt : estimateOf(row, eye->second, truth.camera);
    if (estimate)
      run.frames[row.frame].estimates.push_back(*estimate);
    else
      ++run.outside;
  }
  return run;
}

}  // namespace perdure::tools
