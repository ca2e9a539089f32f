#include <algorithm>
#include <cmath>
#include <map>

#include "common/base/errors.h"
#include "common/replay/files/pose_file.h"
#include "tools/evaluate/object_rows.h"
#include "tools/model/labelled_frames.h"

namespace perdure::tools {
namespace {

constexpr double kSure = 0.9;     // least score of an object that is used as label
constexpr double kInImage = 0.9;  // a box with a smaller share in the image is truncated
constexpr double kHidden = 0.25;  // largest occluded share of a box that is not ignored
constexpr double kBeside = 0.25;  // margin for errors of the map, as a share of a box
constexpr double kSameTime_s = 1e-3;
constexpr std::size_t kLeastViews = 20;

struct View {
  const EstimateRow* row = nullptr;
  Box whole, inside;  ///< the complete box, and its part in the image
  double depth = 0.0;
};

Box common(const Box& a, const Box& b) {
  return {std::max(a.x1, b.x1), std::max(a.y1, b.y1), std::min(a.x2, b.x2), std::min(a.y2, b.y2)};
}
double areaOf(const Box& box) { return std::max(0.0, box.width()) * std::max(0.0, box.height()); }
Box grown(const Box& box, double share) {
  const double x = share * box.width(), y = share * box.height();
  return {box.x1 - x, box.y1 - y, box.x2 + x, box.y2 + y};
}

/// Returns the objects that are at least partly in the image.
std::vector<View> viewsOf(const std::vector<const EstimateRow*>& rows, const RigidTransform& T_WB,
                          const CameraModel& camera) {
  const RigidTransform T_CW = (T_WB * camera.T_BC()).inverse();
  std::vector<View> views;
  for (const EstimateRow* row : rows) {
    const auto box =
        boxAround(row->centre_W, row->yaw, {row->length, row->width, row->height}, T_CW, camera);
    if (!box) continue;
    const Box inside = common(*box, {0, 0, camera.width(), camera.height()});
    if (areaOf(inside) < 1.0) continue;
    views.push_back({row, *box, inside, (T_CW * row->centre_W).z()});
  }
  return views;
}

bool isDoubtful(const View& view, const std::vector<View>& all, double least_px) {
  if (view.row->score < kSure) return true;
  if (areaOf(view.inside) < kInImage * areaOf(view.whole)) return true;
  if (std::max(view.whole.width(), view.whole.height()) < least_px) return true;
  double hidden = 0.0;
  for (const View& other : all) {
    if (other.depth < view.depth) hidden += areaOf(common(other.inside, view.inside));
  }
  return hidden > kHidden * areaOf(view.inside);
}

std::vector<TrueBox> labelsOf(const std::vector<View>& views, const replay::ClassAliases& aliases,
                              double least_px) {
  std::vector<TrueBox> labels;
  for (const View& view : views) {
    labels.push_back({view.inside,
                      aliases.canonical(view.row->class_name),
                      isDoubtful(view, views, least_px),
                      {}});
    labels.push_back({grown(view.inside, kBeside), {}, true, {}});
  }
  return labels;
}

std::set<std::string> judgedIn(const std::vector<LabelledFrame>& frames) {
  std::map<std::string, std::size_t> counts;
  for (const LabelledFrame& frame : frames) {
    for (const TrueBox& box : frame.boxes) {
      if (!box.ignored) ++counts[box.class_name];
    }
  }
  std::set<std::string> judged;
  for (const auto& [name, count] : counts) {
    if (count >= kLeastViews) judged.insert(name);
  }
  return judged;
}

void requireSameFrames(const std::vector<EstimateRow>& rows, const replay::Dataset& dataset,
                       const std::filesystem::path& run) {
  const auto strange = std::ranges::count_if(rows, [&](const EstimateRow& row) {
    const auto time = dataset.frameTime(row.frame);
    return !time || std::abs(toSeconds(*time - row.time)) > kSameTime_s;
  });
  if (2 * static_cast<std::size_t>(strange) <= rows.size()) return;
  throw StartupError(ExitCode::kUnavailable,
                     run.string() +
                         " is of another drive than --frames: the stamps of its frames "
                         "differ; give OUT of a run over these frames");
}

}  // namespace

LabelledData readMapLabels(const LabelRequest& request, std::unique_ptr<replay::Dataset> dataset,
                           const replay::ClassAliases& aliases, double least_px) {
  const auto rows = readObjectRows(request.labels / "objects_final.csv");
  const auto poses =
      posesByFrame(replay::PoseFile::read(request.labels / "trajectory.tum").poses(), rows);
  requireSameFrames(rows, *dataset, request.labels);
  const CameraModel camera(dataset->calibration().cameras.front());
  std::map<std::uint64_t, std::vector<const EstimateRow*>> by_frame;
  for (const EstimateRow& row : rows) by_frame[row.frame].push_back(&row);
  LabelledData data;
  data.sides_known = false;
  for (const auto& [frame, T_WB] : poses) {
    if (frame % request.every != 0 || frame >= dataset->frameCount()) continue;
    data.frames.push_back(
        {frame, labelsOf(viewsOf(by_frame[frame], T_WB, camera), aliases, least_px)});
  }
  data.judged = judgedIn(data.frames);
  if (data.judged.empty()) {
    throw StartupError(ExitCode::kUnavailable,
                       request.labels.string() +
                           " has no class of object that was clearly in view in twenty frames; "
                           "run `perdure pipeline` over a longer drive with such things, all "
                           "classes of the network, and look at its map.png");
  }
  data.dataset = std::move(dataset);
  return data;
}

}  // namespace perdure::tools
