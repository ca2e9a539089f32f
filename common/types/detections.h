// The output of inference: evidence for classes in boxes (eq. 6, 7), not decisions.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/ids.h"

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
  BoxExtent boxes = BoxExtent::kCuboid;
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
