// What inference says: evidence for classes in boxes (eq. 6, 7), not decisions.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/ids.h"

namespace perdure {

/// Corners in pixels of the distorted image; x right, y down; x1 < x2, y1 < y2. They may lie
/// outside the image by the detector's own extrapolation.
struct Box {
  double x1 = 0, y1 = 0, x2 = 0, y2 = 0;
  double width() const { return x2 - x1; }
  double height() const { return y2 - y1; }
  double area() const { return width() * height(); }
};

double intersectionOverUnion(const Box& a, const Box& b);

struct Detection {
  Box box;
  /// K + 1 log-likelihoods before soft-max, [0] = clutter, [k] = class k of the model. Only
  /// differences matter: activations[k] - activations[0] is the log-likelihood ratio of
  /// "an instance of class k is here" against clutter, after the model's calibration.
  std::vector<float> activations;
  std::optional<double> azimuth;  ///< alpha (KITTI), radians; yaw minus bearing of the centre
  double azimuth_sigma = 0.35;    ///< radians, > 0 where azimuth is given
  /// Standard deviation of x1, y1, x2, y2 in pixels, where the network says it of each box; 0 where
  /// it does not: then ModelInfo::box_sigma holds.
  std::array<double, 4> side_sigma{};
  /// The answer to a prediction that no box of its own met (inference README, "Top-down"): the
  /// activations are then log-likelihood ratios of "it is here, and no box was reported" against
  /// "nothing is here". It is evidence about this object alone, and never begins one.
  bool primed = false;
  ObjectId primed_for = 0;  ///< id in Predictions; 0 where not primed
};

struct Detections {
  FrameStamp stamp;
  std::string camera;
  InstanceId instance = 0;       ///< of the inference process
  std::uint64_t model_hash = 0;  ///< refers to ModelInfo
  std::vector<Detection> detections;
  /// Width of the network's input over ModelInfo::input_width, where a time budget made it smaller;
  /// 0: not known, hence 1.
  double input_scale = 0.0;
  /// Elapsed time of the network's forward pass, s; 0: not known. What else a result took is
  /// Perdure's and the bus'.
  double forward_s = 0.0;
};

/// What a detector's boxes enclose of a thing that nothing hides.
enum class BoxExtent : std::uint8_t {
  kCuboid = 0,  ///< the image of its cuboid, as networks that were trained on such labels (KITTI)
  kOutline,     ///< its own image, which is rounder: what boxes drawn by hand enclose (COCO)
};

/// What the activations mean. Latched on the topic `model`, keyed by hash.
struct ModelInfo {
  InstanceId instance = 0;
  std::uint64_t hash = 0;  ///< of weights and model.json
  std::string name;
  std::vector<std::string>
      classes;  ///< lower-case; K names, activations[k + 1] belongs to classes[k]
  std::uint32_t input_width = 0, input_height = 0;
  double box_sigma = 0.0;  ///< standard deviation of a box's side relative to its size; 0 = unknown
  /// Four a class, or none: how far the sides (x1, y1, x2, y2) of its boxes lie inside of what they
  /// enclose by `boxes`, on average, in widths and heights of that.
  std::vector<double> side_insets;
  BoxExtent boxes = BoxExtent::kCuboid;
};

/// How one inference process follows another while frames go on (services/inference/README.md).
enum class SwapStep : std::uint8_t {
  kRehearsing = 0,  ///< `instance` infers beside `about`, unheard
  kTookOver,        ///< it is heard now; `about` watches it for probation_s
  kPassed,          ///< its probation is over: `about` may retire
  kRolledBack,      ///< `about` (or, where it is 0, `instance` itself) is not to be heard: `reason`
  kRetired,         ///< `instance` ends, because `about` has passed
};
const char* nameOf(SwapStep step);  ///< "rehearsing", "took_over", …

/// On the topic `inference/swap`. Any program may take part: it is told and obeyed by DDS alone.
struct SwapNotice {
  InstanceId instance = 0;
  InstanceId about = 0;
  SwapStep step = SwapStep::kRehearsing;
  double probation_s = 0.0;
  std::string model;   ///< name of the newcomer's
  std::string reason;  ///< snake_case, of a roll-back
  std::string detail;
};

}  // namespace perdure
