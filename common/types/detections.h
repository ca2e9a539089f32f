// The output of inference: evidence for classes in boxes (eq. 6, 7), not decisions.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/ids.h"
#include "common/types/description.h"

namespace perdure {

/// Corners in pixels of the distorted image; x right, y down; x1 < x2, y1 < y2. They may lie
/// outside the image, because the detector extrapolates.
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
  double azimuth_sigma = 0.35;    ///< radians, > 0 if azimuth is given
  /// Standard deviation of x1, y1, x2, y2 in pixels, if the network estimates it for each box.
  /// Otherwise it is 0, and ModelInfo::box_sigma applies.
  std::array<double, 4> side_sigma{};
  /// True for the answer to a prediction that no regular box matched (inference README,
  /// "Top-down"). The activations are then log-likelihood ratios of "the object is here, and no box
  /// was reported" against "nothing is here". Such a detection updates this object only; it never
  /// initiates a track.
  bool primed = false;
  ObjectId primed_for = 0;  ///< id in Predictions; 0 if primed is false
};

struct Detections {
  FrameStamp stamp;
  std::string camera;
  InstanceId instance = 0;       ///< id of the inference process
  std::uint64_t model_hash = 0;  ///< refers to ModelInfo
  std::vector<Detection> detections;
  /// Width of the network's input divided by ModelInfo::input_width, if a time budget reduced it.
  /// 0: not known, treated as 1.
  double input_scale = 0.0;
  /// Elapsed time of the network's forward pass, s; 0: not known. The time that Perdure and the bus
  /// add is not included.
  double forward_s = 0.0;
};

/// The extent that a detector's boxes enclose, for an unoccluded object.
enum class BoxExtent : std::uint8_t {
  kCuboid = 0,  ///< the image of the cuboid, as in networks trained on such labels (KITTI)
  kOutline,     ///< the object's own outline, which is rounder, as in hand-drawn labels (COCO)
  kUnknown,     ///< one of both; the filter estimates which
};

/// Describes the meaning of the activations. Latched on the topic `model`, keyed by hash.
struct ModelInfo {
  InstanceId instance = 0;
  std::uint64_t hash = 0;  ///< hash of weights and model.json
  std::string name;
  std::vector<std::string>
      classes;  ///< lower-case; K names, activations[k + 1] belongs to classes[k]
  std::uint32_t input_width = 0, input_height = 0;
  double box_sigma = 0.0;  ///< standard deviation of a box's side relative to its size; 0 = unknown
  /// Four numbers per class, or empty. They are the mean distances by which the sides (x1, y1, x2,
  /// y2) lie inside the extent given by `boxes`, in widths and heights of that extent.
  std::vector<double> side_insets;
  BoxExtent boxes = BoxExtent::kCuboid;  ///< with `side_insets`, kUnknown means kCuboid
};

/// The steps by which one inference process replaces another without a gap in the frames
/// (services/inference/README.md).
enum class SwapStep : std::uint8_t {
  kRehearsing = 0,  ///< `instance` infers in parallel with `about`; its results are not used
  kTookOver,        ///< results of `instance` are used; `about` monitors it for probation_s
  kPassed,          ///< the probation of `instance` is over: `about` may stop
  kRolledBack,      ///< results of `about` (if 0: of `instance`) must not be used; see `reason`
  kRetired,         ///< `instance` stops, because `about` has passed
};
const char* nameOf(SwapStep step);  ///< "rehearsing", "took_over", …

/// Published on the topic `inference/swap`. Any program may take part, because the protocol uses
/// DDS only.
struct SwapNotice {
  InstanceId instance = 0;
  InstanceId about = 0;
  SwapStep step = SwapStep::kRehearsing;
  double probation_s = 0.0;
  std::string model;   ///< name of the new process's model
  std::string reason;  ///< cause of a roll-back, in snake_case
  std::string detail;
};

}  // namespace perdure

namespace perdure::wire {

void describeBox(auto& a, auto& d, auto& w) {
  a.number("x1", d.x1, w[0], kPixel);
  a.number("y1", d.y1, w[1], kPixel);
  a.number("x2", d.x2, w[2], kPixel);
  a.number("y2", d.y2, w[3], kPixel);
  a.ensure("box", "out_of_range", [&] { return d.x1 < d.x2 && d.y1 < d.y2; });
}

void describe(auto& a, Is<Detection> auto& d, auto& w) {
  describeBox(a, d.box, w.corners);
  a.numbers("activations", d.activations, w.activations, kLogit, kClasses + 1);
  a.optionalNumber("azimuth", d.azimuth, w.has_azimuth, w.azimuth, kAngle);
  a.number("azimuth_sigma", d.azimuth_sigma, w.azimuth_sigma, kNotNegative);
  a.ensure("azimuth_sigma", "out_of_range", [&] { return !d.azimuth || d.azimuth_sigma > 0; });
  a.value("primed", d.primed, w.primed);
  a.number("sigma_x1", d.side_sigma[0], w.side_sigma[0], kNotNegative);
  a.number("sigma_y1", d.side_sigma[1], w.side_sigma[1], kNotNegative);
  a.number("sigma_x2", d.side_sigma[2], w.side_sigma[2], kNotNegative);
  a.number("sigma_y2", d.side_sigma[3], w.side_sigma[3], kNotNegative);
  a.value("primed_for", d.primed_for, w.primed_for);
}

void describe(auto& a, Is<Detections> auto& d, auto& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.name("camera", d.camera, w.camera);
  a.value("instance", d.instance, w.source);
  a.value("model_hash", d.model_hash, w.model_hash);
  a.list("detections", d.detections, w.items, kDetections);
  a.number("input_scale", d.input_scale, w.input_scale, kInputScale);
  a.number("forward_s", d.forward_s, w.forward_s, kNotNegative);
}

void describe(auto& a, Is<ModelInfo> auto& d, auto& w) {
  a.value("hash", d.hash, w.model_hash);
  a.value("instance", d.instance, w.source);
  a.text("name", d.name, w.name, kTextLength);
  a.names("classes", d.classes, w.classes, kClasses);
  a.value("input_width", d.input_width, w.input_width);
  a.value("input_height", d.input_height, w.input_height);
  a.ensure("input_width", "out_of_range", [&] { return d.input_width <= kImageSide; });
  a.ensure("input_height", "out_of_range", [&] { return d.input_height <= kImageSide; });
  a.number("box_sigma", d.box_sigma, w.box_sigma, kNotNegative);
  a.numbers("side_insets", d.side_insets, w.side_insets, kInset, 4 * kClasses);
  a.ensure("side_insets", "size_mismatch",
           [&] { return d.side_insets.empty() || d.side_insets.size() == 4 * d.classes.size(); });
  a.choice("boxes", d.boxes, w.boxes, BoxExtent::kUnknown);
}

void describe(auto& a, Is<SwapNotice> auto& d, auto& w) {
  a.value("instance", d.instance, w.source);
  a.value("about", d.about, w.about);
  a.choice("step", d.step, w.step, SwapStep::kRetired);
  a.number("probation_s", d.probation_s, w.probation_s, kNotNegative);
  a.text("model", d.model, w.model, kTextLength);
  a.text("reason", d.reason, w.reason, kNameLength);
  a.text("detail", d.detail, w.detail, kTextLength);
}

}  // namespace perdure::wire
