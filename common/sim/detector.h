// Simulates a detector from the truth, for tests of the filter without a network. It produces boxes
// with noise, misses by size and visibility, false alarms, class confusion, and azimuths with
// flips.
//
// Its class evidence is exact by construction. Each box has a feature vector from a unit Gaussian
// around the mean of its class (clutter: around the origin). The activations are the exact
// log-likelihood ratios of that vector. Errors from similar viewpoints are correlated.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/sim/dice.h"
#include "common/sim/truth.h"
#include "common/types/detections.h"
#include "common/types/sensors.h"

namespace perdure::sim {

/// Two classes that are confused in a fraction `share` of the observations of large, visible
/// objects.
struct ConfusionPair {
  std::string first, second;
  double share = 0.05;
};

/// Parameters of the detector. Sizes are √(width · height) in px of the outline's part in the
/// image.
struct DetectorModel {
  std::uint64_t seed = 1;
  std::vector<std::string> classes{"car",   "van",          "person",  "bicycle",
                                   "chair", "dining table", "monitor", "couch"};

  // Detection probability: found · σ(log₂(size / half_size_px) / size_octaves)
  //                        · σ((visible − half_visible) / visible_softness).
  double found = 0.96;
  double half_size_px = 14.0, size_octaves = 0.25;
  double half_visible = 0.3, visible_softness = 0.06;  ///< fractions of the outline in the image
  double least_visible = 0.08;                         ///< least visible fraction for a detection

  double box_share = 0.03;        ///< σ of a side as a share of the box's width or height
  double box_floor_px = 0.8;      ///< additional σ of a side in pixels, added in quadrature
  double side_correlation = 0.3;  ///< correlation of the errors of opposite sides
  double shrink_below = 0.6;      ///< fraction below which boxes enclose the visible part only
  /// Share of sides whose error is tail_scale times larger.
  double tail_share = 0.0, tail_scale = 5.0;
  /// Time constant of the sides' errors without their persistent share; 0: drawn for each frame.
  double error_time_s = 0.0;
  /// Time in s for which a tracker continues the box of a hidden object, at constant velocity in
  /// the image.
  double coast_s = 0.0;
  BoxExtent boxes = BoxExtent::kOutline;
  bool declare_boxes = true;  ///< false: ModelInfo states that the extent of boxes is unknown

  double false_per_frame = 0.5, false_smallest_px = 8.0;  ///< sizes are log-uniform up to the image

  double separation = 4.0;        ///< distance of a class's mean from clutter's, in σ, at best
  double least_separation = 0.5;  ///< factor for the smallest and most occluded objects
  std::vector<ConfusionPair> confusion{{"car", "van", 0.08}, {"chair", "couch", 0.05}};

  bool azimuth = true;
  double azimuth_sigma = 0.2, flip_share = 0.08;  ///< radians; share of azimuths turned by 180°

  double persistent_share = 0.5;  ///< share of the error variances that is fixed per viewpoint
  double latency_s = 0.0;         ///< delay of the detections; used by the publisher
};

/// For each class, the unit direction of its mean from clutter's in the space of features, as a
/// row. Rows are orthogonal, except for confused pairs. Throws StartupError(kConfiguration) for
/// impossible confusions.
Eigen::MatrixXd classDirections(const DetectorModel& model);

class SimulatedDetector {
 public:
  /// Throws StartupError(kConfiguration) for invalid parameters. `camera`: the camera of the views
  /// in the truth.
  SimulatedDetector(DetectorModel model, Truth truth, const CameraCalibration& camera);

  const ModelInfo& info() const { return info_; }
  const DetectorModel& model() const { return model_; }
  const Truth& truth() const { return truth_; }

  /// The detections in a frame; `frame` counts from 0. T_WB is the true pose of the body in the
  /// world of the truth. The result depends only on the arguments and the seed.
  Detections detect(std::uint64_t frame, const FrameStamp& stamp, const RigidTransform& T_WB) const;
  /// Detection probability of an object by its size in the image and its visible fraction.
  double foundProbability(double size_px, double visible) const;

 private:
  struct Sight;
  class Errors;
  std::vector<Sight> sights(std::uint64_t frame, TimePoint time, const RigidTransform& T_WC) const;
  std::optional<Detection> look(const Sight& sight, const std::vector<Sight>& all,
                                std::uint64_t frame) const;
  Box extentOf(const TruthView& view, const TruthObject& object, const TruthKey& key,
               const RigidTransform& T_WC) const;
  const TruthView* viewOf(std::uint64_t frame, std::uint64_t object) const;
  double visibleShare(const TruthView& view) const;
  void coast(Sight& sight, std::uint64_t frame) const;
  Box visiblePart(const Sight& sight, const std::vector<Sight>& all) const;
  std::optional<Box> withErrors(const Box& box, Errors& errors) const;
  /// `truth`: index of the class, or classes.size() for clutter.
  std::vector<float> activations(std::size_t truth, double quality, Errors& errors) const;
  double quality(double size_px, double visible) const;
  Detection falseAlarm(Dice& dice) const;

  DetectorModel model_;
  Truth truth_;
  CameraModel camera_;
  double width_, height_;
  ModelInfo info_;
  Eigen::MatrixXd means_;  ///< one row per class, of unit length
};

}  // namespace perdure::sim
