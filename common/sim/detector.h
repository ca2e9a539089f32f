// A detector that is drawn from the truth: boxes with noise, misses by size and visibility, false
// alarms, class confusion, azimuths with flips. It measures the filter apart from any network.
//
// Its class evidence is truthful by construction: each box has a feature vector drawn from a unit
// Gaussian about its class's mean (clutter: about the origin), and the activations are the exact
// log-likelihood ratios of that vector. Errors of looks from nearly the same place are alike.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/sim/dice.h"
#include "common/sim/truth.h"
#include "common/types/detections.h"
#include "common/types/sensors.h"

namespace perdure::sim {

/// Two classes that are taken for each other in `share` of the looks at large, visible things.
struct ConfusionPair {
  std::string first, second;
  double share = 0.05;
};

/// Sizes are √(width · height) of the part of the outline within the image, in pixels.
struct DetectorModel {
  std::uint64_t seed = 1;
  std::vector<std::string> classes{"car",   "van",          "person",  "bicycle",
                                   "chair", "dining table", "monitor", "couch"};

  // Found with probability found · σ(log₂(size / half_size_px) / size_octaves)
  //                               · σ((visible − half_visible) / visible_softness).
  double found = 0.96;
  double half_size_px = 14.0, size_octaves = 0.25;
  double half_visible = 0.3, visible_softness = 0.06;  ///< shares of the outline in the image
  double least_visible = 0.08;                         ///< nothing is found below

  double box_share = 0.03;        ///< deviation of a side, share of the box's width or height,
  double box_floor_px = 0.8;      ///< and in pixels beside it (added in squares)
  double side_correlation = 0.3;  ///< of opposite sides' errors
  double shrink_below = 0.6;      ///< boxes of things seen less than this are of the visible part

  double false_per_frame = 0.5, false_smallest_px = 8.0;  ///< sizes are log-uniform up to the image

  double separation = 4.0;        ///< of a class's mean from clutter's, in deviations, at its best
  double least_separation = 0.5;  ///< share of it that is left for the smallest and most hidden
  std::vector<ConfusionPair> confusion{{"car", "van", 0.08}, {"chair", "couch", 0.05}};

  bool azimuth = true;
  double azimuth_sigma = 0.2, flip_share = 0.08;  ///< radians; of azimuths, turned by 180°

  double persistent_share = 0.5;  ///< of all errors' variances: alike while the view is alike
  double latency_s = 0.0;         ///< from the frame to its detections; for who delivers them
};

/// A row of unit length for each class: the direction of its mean from clutter's in the space of
/// features. At right angles, but for pairs that are confused. Throws StartupError(kConfiguration).
Eigen::MatrixXd classDirections(const DetectorModel& model);

class SimulatedDetector {
 public:
  /// Throws StartupError(kConfiguration) for numbers that make no sense. `camera` is the one whose
  /// views the truth holds.
  SimulatedDetector(DetectorModel model, Truth truth, const CameraCalibration& camera);

  const ModelInfo& info() const { return info_; }
  const DetectorModel& model() const { return model_; }
  const Truth& truth() const { return truth_; }

  /// What it sees in the frame with this index, from 0; T_WB is the body's true pose in the
  /// truth's world. Depends on nothing but the arguments and the seed.
  Detections detect(std::uint64_t frame, const FrameStamp& stamp, const RigidTransform& T_WB) const;
  /// The probability with which a thing is found, by the size in the image and the share seen.
  double foundProbability(double size_px, double visible) const;

 private:
  struct Sight;
  class Errors;
  std::vector<Sight> sights(std::uint64_t frame, TimePoint time, const RigidTransform& T_WC) const;
  std::optional<Detection> look(const Sight& sight, const std::vector<Sight>& all,
                                std::uint64_t frame) const;
  Box visiblePart(const Sight& sight, const std::vector<Sight>& all) const;
  std::optional<Box> withErrors(const Box& box, Errors& errors) const;
  /// `truth` is the index of the class, or classes.size() for clutter.
  std::vector<float> activations(std::size_t truth, double quality, Errors& errors) const;
  double quality(double size_px, double visible) const;
  Detection falseAlarm(Dice& dice) const;

  DetectorModel model_;
  Truth truth_;
  double width_, height_;
  RigidTransform T_BC_;
  ModelInfo info_;
  Eigen::MatrixXd means_;  ///< a row for each class, of unit length
};

}  // namespace perdure::sim
