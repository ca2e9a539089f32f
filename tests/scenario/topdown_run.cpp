#include "tests/scenario/topdown_run.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "common/replay/dataset.h"
#include "services/inference/node.h"
#include "services/semantic_filter/node.h"
#include "services/semantic_filter/priors.h"
#include "tools/pipeline/odometry_source.h"
#include "tools/pipeline/settings.h"

namespace perdure::test {
namespace {

constexpr double kKnown_m = 1.5;
constexpr double kSmall_px = 24.0, kLeast_px = 10.0;  // pixels of the network's input
constexpr double kSame = 0.5;

/// The image of a true object in a frame.
struct Target {
  Box box;
  bool ignored = true, small = false, hidden = false;
};

Target judge(const sim::TruthView& view, const CameraModel& camera, double input_scale) {
  const double w = camera.width(), h = camera.height();
  Target t;
  t.box = {std::clamp(view.box.x1, 0.0, w), std::clamp(view.box.y1, 0.0, h),
           std::clamp(view.box.x2, 0.0, w), std::clamp(view.box.y2, 0.0, h)};
  if (t.box.width() < 2.0 || t.box.height() < 2.0) return t;
  const double seen = std::min(1.0, view.visible_fraction * view.box.area() / t.box.area());
  const double longer = std::max(t.box.width(), t.box.height()) * input_scale;
  t.ignored = seen < 0.25 || longer < kLeast_px;
  t.hidden = !t.ignored && seen < 0.7;
  t.small = !t.ignored && !t.hidden && std::sqrt(t.box.area()) * input_scale < kSmall_px;
  return t;
}

std::set<std::uint64_t> onTheMap(const TopDownRun& run, const LookedAt& look) {
  std::set<std::uint64_t> ids;
  const TimePoint time = run.truth.frames[look.frame];
  for (const auto& object : run.truth.truth.objects) {
    const Eigen::Vector3d centre = object.at(time).centre_W;
    for (const ObjectBelief& belief : look.before.objects) {
      if (!belief.confirmed || belief.classes.empty()) continue;
      const auto best = std::max_element(
          belief.classes.begin(), belief.classes.end(),
          [](const auto& a, const auto& b) { return a.probability < b.probability; });
      if (best->name == object.class_name && (best->mean.head<3>() - centre).norm() < kKnown_m) {
        ids.insert(object.id);
      }
    }
  }
  return ids;
}

Box cut(const Box& b, const CameraModel& camera) {
  const double w = camera.width(), h = camera.height();
  return {std::clamp(b.x1, 0.0, w), std::clamp(b.y1, 0.0, h), std::clamp(b.x2, 0.0, w),
          std::clamp(b.y2, 0.0, h)};
}

double strength(const Detection& d) {
  return *std::max_element(d.activations.begin() + 1, d.activations.end());
}

}  // namespace

TopDownRun driveThrough(const TopDownSetting& setting) {
  TopDownRun run{tools::readSimulatedTruth(setting.data), {}, {}};
  const auto dataset = replay::Dataset::open({.path = setting.data});
  inference::Node network(setting.inference, 3);
  run.classes = network.model().classes;
  tools::PipelineOptions options;
  const auto config = tools::readServiceConfigs(options).semantic_filter;
  Objects objects;
  Predictions expected;
  semantic_filter::Node filter(config, semantic_filter::loadPriors(config), 4,
                               {.objects = [&](const Objects& m) { objects = m; },
                                .events = {},
                                .predictions = [&](const Predictions& m) { expected = m; }});
  filter.onCalibration(dataset->calibration());
  filter.onModel(network.model());
  tools::PoseOdometry poses(*dataset->truth(), 2, {1, 0}, tools::ofExactTruth());
  while (const auto message = dataset->next()) {
    const Frame* frame = std::get_if<Frame>(&*message);
    if (frame == nullptr || frame->camera != "cam0") continue;
    const auto odometry = poses.at(frame->stamp);
    if (!odometry) continue;
    const auto found = network.infer(*frame, expected);
    if (!found) continue;
    run.frames.push_back({frame->stamp.sequence, *found, objects});
    filter.onOdometry(*odometry);
    filter.onDetections(*found);
    if (frame->stamp.sequence == setting.plant_at && !setting.planted.empty()) {
      MapNear near;
      near.instance = 5;
      near.client = filter.instance();
      near.revision = 1;
      near.world = odometry->world;
      near.placed = setting.planted;
      filter.onNear(near);
    }
  }
  return run;
}

HardRecall& HardRecall::operator+=(const HardRecall& more) {
  small += more.small, small_found += more.small_found;
  hidden += more.hidden, hidden_found += more.hidden_found;
  ordinary_found += more.ordinary_found;
  false_alarms += more.false_alarms, false_primed += more.false_primed;
  frames += more.frames;
  return *this;
}

HardRecall hardRecall(const TopDownRun& run, const TopDownRun& known, double input_scale,
                      double least) {
  HardRecall result;
  for (std::size_t i = 0; i < run.frames.size() && i < known.frames.size(); ++i) {
    const LookedAt& look = run.frames[i];
    const auto views = run.truth.truth.views.find(look.frame);
    if (views == run.truth.truth.views.end()) continue;
    ++result.frames;
    const auto ids = onTheMap(known, known.frames[i]);
    std::vector<Target> targets;
    std::vector<bool> asked, found;
    for (const auto& view : views->second) {
      targets.push_back(judge(view, run.truth.camera, input_scale));
      asked.push_back(ids.contains(view.object_id));
    }
    found.resize(targets.size(), false);
    std::vector<const Detection*> boxes;
    for (const Detection& d : look.detections.detections) {
      if (!d.primed || strength(d) >= least) boxes.push_back(&d);
    }
    std::stable_sort(boxes.begin(), boxes.end(), [](const Detection* a, const Detection* b) {
      return std::pair(!a->primed, strength(*a)) > std::pair(!b->primed, strength(*b));
    });
    for (const Detection* d : boxes) {
      const Box box = cut(d->box, run.truth.camera);
      double best = 0.0, any = 0.0;
      std::size_t which = 0;
      for (std::size_t t = 0; t < targets.size(); ++t) {
        const double iou = intersectionOverUnion(box, targets[t].box);
        any = std::max(any, iou);
        if (!found[t] && iou > best) best = iou, which = t;
      }
      if (best >= kSame) {
        found[which] = true;
        const Target& t = targets[which];
        if (asked[which] && (t.small || t.hidden) && !d->primed) ++result.ordinary_found;
      } else if (any < kSame) {
        ++result.false_alarms;
        if (d->primed) ++result.false_primed;
      }
    }
    for (std::size_t t = 0; t < targets.size(); ++t) {
      if (!asked[t]) continue;
      result.small += targets[t].small;
      result.small_found += targets[t].small && found[t];
      result.hidden += targets[t].hidden;
      result.hidden_found += targets[t].hidden && found[t];
    }
  }
  return result;
}

}  // namespace perdure::test
