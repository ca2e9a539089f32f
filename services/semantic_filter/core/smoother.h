// Smooth: the state of a hypothesis from all remembered looks at once (the maximum of its
// posterior, by Gauss-Newton), in place of what the filter made of them one after the other.
//
// The model is the filter's own: sides with noise and with the object's b, an Ornstein-Uhlenbeck
// process along the change of view; the pose error of each look, with its correlation between looks
// and with the present one; t-distributed boxes; the class's prior of size; for what moves, its
// speed's prior and white acceleration. b, the pose errors and the accelerations are marginal, so
// that the covariance of the sides of all looks is one full matrix.
#pragma once

#include <optional>

#include "services/semantic_filter/core/batch_model.h"

namespace perdure::semantic_filter {

/// A hypothesis as the looks have it. The looks and the frame outlive it.
class Smoothed {
 public:
  /// Nothing where the looks do not see `start`, or do not fix its place.
  static std::optional<Smoothed> make(const Hypothesis& start, const Looks& looks,
                                      const FrameContext& frame);

  const Hypothesis& hypothesis() const { return hypothesis_; }
  /// By how much each look's noise is widened (t distribution), >= 1.
  const Eigen::VectorXd& doubts() const { return doubts_; }
  /// Share of the looks that contradict it.
  double contradicted() const { return contradicted_.cast<double>().mean(); }
  /// 1 for each look that does.
  const Eigen::ArrayXi& contradictions() const { return contradicted_; }
  /// log p(looks | this class, and that it moves or not), by Laplace's method. To compare two, both
  /// are asked with the same doubts.
  double logEvidence(const Eigen::VectorXd& doubts) const;

 private:
  Smoothed(const Looks& looks, const FrameContext& frame) : looks_(&looks), frame_(&frame) {}

  Hypothesis hypothesis_;
  Eigen::VectorXd doubts_;
  Eigen::ArrayXi contradicted_;
  const Looks* looks_;
  const FrameContext* frame_;
  double start_yaw_ = 0.0;
};

/// Remembers this box of the object's where it shows something new. Whether the object is then to
/// be smoothed.
bool rememberLook(Object& object, const Evidence& box, const std::array<bool, 4>& hidden,
                  const FrameContext& frame);
/// How much there is to gain: 1 and more is worth it.
double smoothingNeed(const Object& object);
/// Smooths the object's hypotheses and weighs within each class whether it moves.
void smooth(Object& object, const FrameContext& frame);

}  // namespace perdure::semantic_filter
