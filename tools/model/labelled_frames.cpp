#include "tools/model/labelled_frames.h"

#include <algorithm>
#include <limits>

#include "common/base/errors.h"
#include "common/math/so3.h"
#include "common/replay/files/kitti_labels.h"
#include "tools/evaluate/simulated_truth.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

constexpr double kNothingSeen = 0.05, kEnoughSeen = 0.25, kWhollySeen = 0.95;

/// Returns the box of the object's cuboid if all its corners are in the image.
std::optional<Box> hullOf(const sim::TruthObject& object, const sim::TruthKey& key,
                          const RigidTransform& T_CW, const CameraModel& camera) {
  const auto box = boxAround(key.centre_W, key.yaw, object.size, T_CW, camera);
  const bool inside =
      box && camera.inImage({box->x1, box->y1}) && camera.inImage({box->x2, box->y2});
  return inside ? box : std::nullopt;
}

/// Converts a view of a simulated object to a label. Returns nothing if its visible part is too
/// small.
std::optional<TrueBox> labelOf(const sim::TruthView& view, const CameraModel& camera,
                               double least_px) {
  const Box box = view.boxInside(camera.width(), camera.height());
  if (box.width() < 1.0 || box.height() < 1.0 || view.visible_fraction < 0.01) return std::nullopt;
  const double seen = std::min(1.0, view.visible_fraction * view.box.area() / box.area());
  if (seen < kNothingSeen) return std::nullopt;
  TrueBox label;
  label.box = box;
  label.ignored = seen < kEnoughSeen || std::max(box.width(), box.height()) < least_px;
  return label;
}

LabelledData readSimulated(const LabelRequest& request, const replay::ClassAliases& aliases,
                           double least_px) {
  const SimulatedTruth truth = readSimulatedTruth(request.data);
  LabelledData data;
  data.dataset = replay::Dataset::open({.path = request.data});
  for (std::uint64_t i = 0; i < truth.frames.size(); i += request.every) {
    LabelledFrame frame{i, {}};
    const auto body = truth.body.at(i, truth.frames[i]);
    const auto views = truth.truth.views.find(i);
    if (views == truth.truth.views.end()) {
      data.frames.push_back(frame);
      continue;
    }
    for (const auto& view : views->second) {
      const auto& all = truth.truth.objects;
      const auto object =
          std::ranges::find_if(all, [&](const auto& o) { return o.id == view.object_id; });
      auto label = labelOf(view, truth.camera, least_px);
      if (object == all.end() || !label) continue;
      label->class_name = aliases.canonical(object->looks_like);
      if (body && view.visible_fraction >= kWhollySeen) {
        label->hull = hullOf(*object, object->at(truth.frames[i]),
                             (*body * truth.camera.T_BC()).inverse(), truth.camera);
      }
      frame.boxes.push_back(*std::move(label));
    }
    data.frames.push_back(std::move(frame));
  }
  return data;
}

fs::path labelFile(const LabelRequest& request, replay::DatasetKind kind) {
  if (!request.labels.empty()) return request.labels;
  if (kind == replay::DatasetKind::kKittiTracking) {
    return request.data / "label_02" / (request.sequence + ".txt");
  }
  throw StartupError(
      ExitCode::kUnavailable,
      "{} has no labels of its own; give --labels OUT of a run of `perdure pipeline` over it, "
      "--labels label_02/SEQUENCE.txt, or a folder that `perdure simulate --out` made",
      request.data.string());
}

TrueBox labelOf(const replay::KittiLabel& label, const replay::ClassAliases& aliases,
                double least_px) {
  TrueBox box;
  box.box = label.box;
  if (label.dontCare()) {
    box.ignored = true;
    return box;
  }
  box.class_name = aliases.canonical(label.type);
  box.ignored = label.occluded > 1 || label.truncated > 0 ||
                std::max(label.box.width(), label.box.height()) < least_px;
  return box;
}

LabelledData readKitti(const LabelRequest& request, std::unique_ptr<replay::Dataset> dataset,
                       const replay::ClassAliases& aliases, double least_px) {
  LabelledData data;
  // Persons and bicycles are excluded. Networks report both for a cyclist, but KITTI labels only
  // some of them.
  data.judged = {"car", "truck", "van"};
  const auto labels = replay::readKittiLabels(labelFile(request, dataset->kind()));
  for (std::uint64_t i = 0; i < dataset->frameCount(); i += request.every) {
    data.frames.push_back({i, {}});
  }
  for (const auto& label : labels) {
    if (label.frame % request.every != 0) continue;
    const std::uint64_t row = label.frame / request.every;
    if (row >= data.frames.size()) continue;
    data.frames[row].boxes.push_back(labelOf(label, aliases, least_px));
  }
  data.dataset = std::move(dataset);
  return data;
}

}  // namespace

std::optional<Box> boxAround(const Eigen::Vector3d& centre_W, double yaw,
                             const Eigen::Vector3d& size, const RigidTransform& T_CW,
                             const CameraModel& camera) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Box box{kInfinity, kInfinity, -kInfinity, -kInfinity};
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d half(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5,
                               corner & 4 ? 0.5 : -0.5);
    const auto pixel =
        camera.project(T_CW * (centre_W + rotationAboutZ(yaw) * half.cwiseProduct(size)));
    if (!pixel) return std::nullopt;
    box.x1 = std::min(box.x1, pixel->x()), box.x2 = std::max(box.x2, pixel->x());
    box.y1 = std::min(box.y1, pixel->y()), box.y2 = std::max(box.y2, pixel->y());
  }
  return box;
}

LabelledData readLabelled(const LabelRequest& request, const replay::ClassAliases& aliases,
                          double least_px) {
  const bool by_map = fs::is_directory(request.labels);
  if (isSimulated(request.data) && !by_map) {
    if (request.labels.empty()) return readSimulated(request, aliases, least_px);
    throw StartupError(ExitCode::kUnavailable,
                       request.labels.string() +
                           " is no folder, and a simulated drive has no label files; give OUT of "
                           "`perdure pipeline` over it, or leave out --labels for its own truth");
  }
  auto dataset = replay::Dataset::open({.path = request.data, .sequence = request.sequence});
  if (by_map) return readMapLabels(request, std::move(dataset), aliases, least_px);
  return readKitti(request, std::move(dataset), aliases, least_px);
}

}  // namespace perdure::tools
