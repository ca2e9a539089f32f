#include "services/inference/config.h"

#include <algorithm>

namespace perdure::inference {

void describe(Config& config, config::Fields& fields) {
  using config::between;
  fields.text("model.path", config.model.path,
              {"network: an .onnx file, or a Darknet .cfg with its .weights beside it"});
  fields.text("model.description", config.model.description,
              {"model.json of the network; empty: PATH.model.json, model.json beside it, or "
               "config/models/<stem>.json"});
  fields.choice("model.backend", config.model.backend, {"auto", "opencv", "onnxruntime"},
                {"library that runs the network; auto: OpenCV, or ONNX Runtime (if the program was "
                 "built with it) for files that OpenCV does not support"});
  fields.integer("model.threads", config.model.threads, between(1, 64),
                 {"number of threads for one image", "", "use at most the cores of the machine"});
  fields.number("model.budget_ms", config.model.budget_ms, between(0.0, 10000.0),
                {"largest time of a frame, from image to detections; the input size is reduced to "
                 "keep it; 0: always the network's own size",
                 "ms"});
  fields.text("detection.camera", config.detection.camera, {"camera whose frames are read"});
  fields.choice("detection.turn", config.detection.turn, {"auto", "0", "90", "180", "270"},
                {"clockwise turn that makes the images upright for the network; auto: by the "
                 "newest odometry, 0 until there is one",
                 "deg"});
  fields.number(
      "detection.score_threshold", config.detection.score_threshold, between(0.001, 0.999),
      {"smallest score of the best class of a box; low, because the filter also uses weak evidence",
       "", "0.05 keeps the weak evidence that the filter uses; above 0.3 objects are lost"});
  fields.number(
      "detection.merge_iou", config.detection.merge_iou, between(0.1, 1.0),
      {"boxes with a larger overlap (IoU) are merged into one, regardless of their classes"});
  fields.integer(
      "detection.limit", config.detection.limit, between(1, 512),
      {"largest number of detections in one frame; those with the most evidence are kept"});
  fields.texts("detection.classes", config.detection.classes,
               {"classes to report, with the network's names; empty: all"});
  fields.boolean("detection.prime", config.detection.prime,
                 {"report the best activation at a predicted object without a box; requires "
                  "calibration.primed in model.json"});
  fields.integer("ownership.strength", config.ownership.strength, between(2, 1000000),
                 {"the running inference process with the highest strength is used"});
  fields.boolean("ownership.standby", config.ownership.standby,
                 {"use one less than the strength, and take over when the owner ends"});
  fields.number(
      "ownership.period_s", config.ownership.period_s, between(0.005, 10.0),
      {"expected interval between frames; the lease is three intervals, at least 100 ms", "s"});
  fields.number("ownership.probation_s", config.ownership.probation_s, between(0, 86400),
                {"above 0: rehearse beside the active process, take over, be checked by it for "
                 "this time, and then replace it",
                 "s"});
}

double leaseSeconds(const OwnershipConfig& ownership) {
  return std::max(3.0 * ownership.period_s, 0.1);
}

}  // namespace perdure::inference
