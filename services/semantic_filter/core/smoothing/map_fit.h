// MAP fit of a hypothesis to all keyframes by Levenberg-Marquardt (Dellaert, Kaess 2017; Nielsen
// 1999). b, pose errors and accelerations are marginalised; tools/docs/maths/map_fit.md.
#pragma once

#include <memory>
#include <optional>

#include "services/semantic_filter/core/belief/learned.h"
#include "services/semantic_filter/core/smoothing/batch_problem.h"

namespace perdure::semantic_filter {

using KeyframeCounts = Eigen::Array<int, Eigen::Dynamic, 1, 0, kMostKeyframes, 1>;

/// One hypothesis, fitted to all keyframes; valid within one step. Batch and frame must outlive it.
class MapFit {
 public:
  struct Fit;

  /// Returns nothing if `start` has no projection in a keyframe, if the position stays uncertain,
  /// or if the fit reaches one of the modes `found`. `like`: a mode of the same batch and motion,
  /// whose inflations and covariance the fit begins with.
  static std::optional<MapFit> make(const Hypothesis& start, const KeyframeBatch& batch,
                                    const FrameContext& frame, const MapFit* like = nullptr,
                                    const ScratchVector<const Hypothesis*>& found = {});

  const Hypothesis& hypothesis() const { return hypothesis_; }
  /// Returns the share of keyframes that contradict the fit.
  double contradicted() const { return contradictions().cast<double>().mean(); }
  /// Returns the evidence about the variances of the sides, by restricted likelihood, for an object
  /// at rest.
  SideEvidence sideEvidence() const;
  /// Returns the squared residuals of the azimuths, relative to the assumed variances. The count is
  /// that of the degrees of freedom.
  ResidualRatio azimuthResidualRatio() const;
  std::size_t sides() const;
  /// Returns 1 for each keyframe that contradicts the fit, 0 for the others.
  const KeyframeCounts& contradictions() const;
  /// Returns the log marginal likelihood, log p(boxes | class, motion), by Laplace's method, with
  /// the t distribution of each keyframe, without a constant. `of_yaw`: for modes of yaw; with the
  /// azimuths and without the yaw prior around the start.
  double logEvidence(bool of_yaw = false) const;
  /// Returns the log-odds, by the azimuths, that the fitted yaw is not turned by 180°.
  double logHeading() const;

 private:
  MapFit(const KeyframeBatch& batch, const FrameContext& frame) : batch_(&batch), frame_(&frame) {}
  BatchProblem modelOf() const;

  Hypothesis hypothesis_;
  std::shared_ptr<const Fit> fit_;
  const KeyframeBatch* batch_;
  const FrameContext* frame_;
  State start_ = State::Zero();
};

}  // namespace perdure::semantic_filter
