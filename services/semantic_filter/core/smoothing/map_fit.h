// Smooth: the state of a hypothesis from all remembered looks at once (the maximum of its
// posterior, by Gauss-Newton), in place of what the filter made of them one after the other.
//
// The model is the filter's own: sides with noise and with the object's b, an Ornstein-Uhlenbeck
// process along the change of view; the pose error of each look, with its correlation between looks
// and with the present one; t-distributed boxes; the class's prior of size; for what moves, its
// speed's prior and white acceleration. b, the pose errors and the accelerations are marginal, so
// that the covariance of the sides of all looks is one full matrix.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/belief/noise_scale.h"
#include "services/semantic_filter/core/smoothing/batch_problem.h"

namespace perdure::semantic_filter {

/// A hypothesis as the looks have it. The looks and the frame outlive it.
class Smoothed {
 public:
  struct Fit;

  /// Nothing where the looks do not see `start`, or do not fix its place. `like`: another mode of
  /// the same looks, at rest or moving as `start`, to begin with what it found of the boxes'
  /// errors. `found`: modes of the same looks, to which a further fit need not come: nothing where
  /// it does.
  static std::optional<Smoothed> make(const Hypothesis& start, const Looks& looks,
                                      const FrameContext& frame, const Smoothed* like = nullptr,
                                      const std::vector<const Hypothesis*>& found = {});

  const Hypothesis& hypothesis() const { return hypothesis_; }
  /// By how much each look's noise is widened (t distribution), >= 1.
  const Eigen::VectorXd& doubts() const;
  /// Share of the looks that contradict it.
  double contradicted() const { return contradictions().cast<double>().mean(); }
  /// What it leaves over of the boxes, beside what was assumed of their errors at first; of as many
  /// sides as it has degrees of freedom.
  Leftover leftover() const;
  /// The same of the azimuths.
  Leftover leftoverOfAzimuths() const;
  /// Sides that count as measured, of all looks.
  std::size_t sides() const;
  /// 1 for each look that does.
  const Eigen::ArrayXi& contradictions() const;
  /// log p(boxes | this class, and that it moves or not), by Laplace's method. To compare two, both
  /// are asked with the same doubts. `of_yaw`: to compare modes of yaw, with what azimuths say and
  /// without the prior around the start.
  double logEvidence(const Eigen::VectorXd& doubts, bool of_yaw = false) const;
  /// Log-odds that the azimuths mean its yaw and not the one turned by 180°.
  double logHead() const;

 private:
  Smoothed(const Looks& looks, const FrameContext& frame) : looks_(&looks), frame_(&frame) {}
  BatchModel modelOf() const;

  Hypothesis hypothesis_;
  std::shared_ptr<const Fit> fit_;
  const Looks* looks_;
  const FrameContext* frame_;
  State start_ = State::Zero();
};

}  // namespace perdure::semantic_filter
