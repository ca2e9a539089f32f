#include "services/inference/config.h"

#include <algorithm>

namespace perdure::inference {

void describe(Config& config, config::Fields& fields) {
  using config::between;
  fields.text("model.path", config.model.path,
              {"the network: an .onnx file, or a Darknet .cfg with its .weights beside it"});
  fields.text("model.description", config.model.description,
              {"its model.json; empty: PATH.model.json, model.json beside it, or "
               "config/models/<stem>.json"});
  fields.choice("model.backend", config.model.backend, {"auto", "opencv", "onnxruntime"},
                {"what computes it; auto: OpenCV, and ONNX Runtime for a file that OpenCV does not "
                 "take, where the program was built with it"});
  fields.integer("model.threads", config.model.threads, between(1, 64),
                 {"threads for one image", "", "use at most the cores of the machine"});
  fields.number("model.budget_ms", config.model.budget_ms, between(0.0, 10000.0),
                {"most time of a frame, picture to detections: where it is not kept the input is "
                 "made smaller, and larger again; 0: always the network's own size",
                 "ms"});
  fields.text("detection.camera", config.detection.camera,
              {"the camera whose frames are looked at"});
  fields.number("detection.score_threshold", config.detection.score_threshold,
                between(0.001, 0.999),
                {"lax: boxes whose best class scores less are left out", "",
                 "0.05 keeps the evidence that the filter wants; above 0.3 objects are lost"});
  fields.number("detection.merge_iou", config.detection.merge_iou, between(0.1, 1.0),
                {"boxes that overlap more are merged into one, of whatever class"});
  fields.integer("detection.limit", config.detection.limit, between(1, 512),
                 {"most detections of one frame; those of most evidence are kept"});
  fields.texts("detection.classes", config.detection.classes,
               {"classes to report, by the network's names; empty: all"});
  fields.boolean("detection.prime", config.detection.prime,
                 {"report the best activation where semantic_filter expects an object and no box "
                  "is; needs calibration.primed in model.json"});
  fields.integer("ownership.strength", config.ownership.strength, between(2, 1000000),
                 {"of several living inference processes the strongest is heard"});
  fields.boolean("ownership.standby", config.ownership.standby,
                 {"stand by: offer one less than the strength, and take over when the owner dies"});
  fields.number("ownership.period_s", config.ownership.period_s, between(0.005, 10.0),
                {"expected time between frames; the lease is three of them, at least 100 ms", "s"});
  fields.number("ownership.probation_s", config.ownership.probation_s, between(0, 86400),
                {"above 0: follow the process that is heard: rehearse beside it, take over, be "
                 "watched by it for so long, and then tell it to retire",
                 "s"});
}

double leaseSeconds(const OwnershipConfig& ownership) {
  return std::max(3.0 * ownership.period_s, 0.1);
}

}  // namespace perdure::inference
