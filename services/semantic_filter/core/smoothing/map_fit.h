// Smooth: the state of a hypothesis from all remembered batch at once (the maximum of its
// posterior, by Gauss-Newton), in place of what the filter made of them one after the other.
//
// The model is the filter's own: sides with noise and with the track's b, an Ornstein-Uhlenbeck
// process along the change of view; the pose error of each look, with its correlation between batch
// and with the present one; t-distributed boxes; the class's prior of size; for what moves, its
// speed's prior and white acceleration. b, the pose errors and the accelerations are marginal, so
// that the covariance of the sides of all batch is one full matrix.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/belief/noise_scale.h"
#include "services/semantic_filter/core/smoothing/batch_problem.h"

namespace perdure::semantic_filter {

/// A hypothesis as the batch have it. The batch and the frame outlive it.
class MapFit {
 public:
  struct Fit;

  /// Nothing where the batch do not see `start`, or do not fix its place. `like`: another mode of
  /// the same batch, at rest or moving as `start`, to begin with what it found of the boxes'
  /// errors. `found`: modes of the same batch, to which a further fit need not come: nothing where
  /// it does.
  static std::optional<MapFit> make(const Hypothesis& start, const KeyframeBatch& batch,
                                    const FrameContext& frame, const MapFit* like = nullptr,
                                    const std::vector<const Hypothesis*>& found = {});

  const Hypothesis& hypothesis() const { return hypothesis_; }
  /// By how much each look's noise is widened (t distribution), >= 1.
  const Eigen::VectorXd& inflations() const;
  /// Share of the batch that contradict it.
  double contradicted() const { return contradictions().cast<double>().mean(); }
  /// What it leaves over of the boxes, beside what was assumed of their errors at first; of as many
  /// sides as it has degrees of freedom.
  ResidualRatio residualRatio() const;
  /// The same of the azimuths.
  ResidualRatio azimuthResidualRatio() const;
  /// Sides that count as measured, of all batch.
  std::size_t sides() const;
  /// 1 for each look that does.
  const Eigen::ArrayXi& contradictions() const;
  /// log p(boxes | this class, and that it moves or not), by Laplace's method. To compare two, both
  /// are asked with the same inflations. `of_yaw`: to compare modes of yaw, with what azimuths say
  /// and without the prior around the start.
  double logEvidence(const Eigen::VectorXd& inflations, bool of_yaw = false) const;
  /// Log-odds that the azimuths mean its yaw and not the one turned by 180°.
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
