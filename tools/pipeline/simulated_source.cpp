#include "tools/pipeline/simulated_source.h"

#include "common/base/errors.h"
#include "common/replay/files/text_file.h"

namespace perdure::tools {
namespace {

sim::ConfusionPair pairOf(const std::string& text) {
  const auto slash = text.find('/'), equals = text.rfind('=');
  const bool whole = slash != std::string::npos && equals != std::string::npos && slash < equals;
  const auto share =
      whole ? replay::parseNumber(replay::trim(text.substr(equals + 1))) : std::optional<double>();
  if (!share) {
    throw StartupError(ExitCode::kConfiguration,
                       "detector.confusion: `" + text +
                           "` is no pair of classes with a share; write car/van=0.08");
  }
  return {std::string(replay::trim(text.substr(0, slash))),
          std::string(replay::trim(text.substr(slash + 1, equals - slash - 1))), *share};
}

sim::Truth truthOf(const std::string& folder, const replay::Dataset& dataset) {
  if (!sim::hasTruth(folder) || !dataset.truth()) {
    throw StartupError(ExitCode::kUnavailable,
                       "--detections simulated needs a simulated folder (objects_truth.json, "
                       "visibility_truth.csv, exact states), and " +
                           folder +
                           " is none; make one with perdure simulate, or give a CSV, model or "
                           "none");
  }
  return sim::readTruth(folder);
}

}  // namespace

void describe(DetectorConfig& config, config::Fields& fields) {
  sim::DetectorModel& m = config.model;
  using config::atLeast, config::between, config::positive;
  fields.integer("seed", config.seed, atLeast(0), {"of all that is drawn; --seed sets it too"});
  fields.texts("classes", m.classes, {"that it knows; what looks like no one of them is not seen"});
  fields.number("found", m.found, between(0, 1),
                {"probability that a large thing in full sight is found"});
  fields.number("half_size", m.half_size_px, positive(),
                {"√(width · height) in the image at which half of them are found", "px"});
  fields.number("size_octaves", m.size_octaves, positive(), {"how gradually, in octaves of size"});
  fields.number("half_visible", m.half_visible, between(0, 1),
                {"share in sight at which half of them are found"});
  fields.number("visible_softness", m.visible_softness, positive(), {"how gradually"});
  fields.number("least_visible", m.least_visible, between(0, 1),
                {"nothing is found of which less is in sight"});
  fields.number("box_share", m.box_share, atLeast(0),
                {"deviation of a side, share of the box's width or height"});
  fields.number("box_floor", m.box_floor_px, atLeast(0), {"the same beside it", "px"});
  fields.number("side_correlation", m.side_correlation, between(0, 1),
                {"of opposite sides' errors"});
  fields.number("shrink_below", m.shrink_below, between(0, 1),
                {"boxes of things seen less than this are of the visible part"});
  fields.number("tail_share", m.tail_share, between(0, 1), {"of sides with heavy errors"});
  fields.number("tail_scale", m.tail_scale, atLeast(1), {"of their deviation"});
  fields.number("error_time", m.error_time_s, atLeast(0),
                {"time constant of the sides' errors; 0: independent in each frame", "s"});
  fields.number("coast", m.coast_s, between(0, 10),
                {"the box of an object that becomes hidden is continued for so long", "s"});
  fields.choice("boxes", config.boxes, {"cuboid", "outline"}, {"what the boxes enclose"});
  fields.boolean("declare_boxes", m.declare_boxes,
                 {"false: the model's information does not contain `boxes`"});
  fields.number("false_per_frame", m.false_per_frame, between(0, 100), {"mean of false alarms"});
  fields.number("false_smallest", m.false_smallest_px, positive(),
                {"side of the smallest false alarm", "px"});
  fields.number("separation", m.separation, positive(),
                {"of a class from clutter in the features, in deviations, at its best"});
  fields.number("least_separation", m.least_separation, between(0, 1),
                {"share of it that is left for the smallest and most hidden"});
  fields.texts("confusion", config.confusion,
               {"pairs of classes, and the share of large, visible ones taken for each other"});
  fields.boolean("azimuth", m.azimuth, {"whether it gives one"});
  fields.number("azimuth_sigma", m.azimuth_sigma, positive(), {"its deviation", "rad"});
  fields.number("flip_share", m.flip_share, between(0, 1), {"of azimuths that are turned by 180°"});
  fields.number("persistent_share", m.persistent_share, between(0, 1),
                {"of all errors' variances: alike while the view is alike"});
  fields.number("latency", m.latency_s, between(0, 10), {"from a frame to its detections", "s"});
}

sim::DetectorModel modelOf(const DetectorConfig& config) {
  sim::DetectorModel model = config.model;
  model.seed = static_cast<std::uint64_t>(config.seed);
  model.boxes = config.boxes == "cuboid" ? BoxExtent::kCuboid : BoxExtent::kOutline;
  model.confusion.clear();
  for (const std::string& text : config.confusion) model.confusion.push_back(pairOf(text));
  return model;
}

SimulatedDetections::SimulatedDetections(const DetectorConfig& config, const std::string& folder,
                                         const replay::Dataset& dataset, InstanceId instance)
    : detector_(modelOf(config), truthOf(folder, dataset), dataset.calibration().cameras.front()),
      body_(*dataset.truth()),
      instance_(instance),
      latency_(durationFromSeconds(config.model.latency_s)) {}

ModelInfo SimulatedDetections::info() const {
  ModelInfo info = detector_.info();
  info.instance = instance_;
  return info;
}

void SimulatedDetections::look(const Frame& frame) {
  const auto T_WB = body_.at(frame.stamp.sequence, frame.stamp.time);
  if (!T_WB) return;
  Detections detections = detector_.detect(frame.stamp.sequence, frame.stamp, *T_WB);
  detections.camera = frame.camera;
  detections.instance = instance_;
  waiting_.emplace(frame.stamp.time + latency_, std::move(detections));
}

std::vector<Detections> SimulatedDetections::due(TimePoint now) {
  std::vector<Detections> result;
  while (!waiting_.empty() && waiting_.begin()->first <= now) {
    result.push_back(std::move(waiting_.begin()->second));
    waiting_.erase(waiting_.begin());
  }
  return result;
}

}  // namespace perdure::tools
