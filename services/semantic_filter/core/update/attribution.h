// What a look changed, and why: how the step of existence and PMF divides into what the network
// said, what the geometry said, and what a screen excused. Only the ledger reads it; the step
// itself is update.h's.
#pragma once

#include <optional>
#include <vector>

#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// How one hypothesis divides a look among "no box" and the boxes.
struct Shares {
  double A = 1.0;           ///< P(look | it) against P(look | nothing there)
  double none = 1.0;        ///< posterior share of "none of the boxes"
  std::vector<double> box;  ///< posterior share of each box of the look
};

/// What is known of a look before the weights change.
struct LookReasons {
  ExistenceEvidence kind = ExistenceEvidence::kHit;
  double excused = 0.0;  ///< nats of a miss that a screen explains, >= 0
  /// Of a look that shows the track: what the network's activations add to log π of each class.
  std::vector<ClassNumber> activation;
};

/// `looked_at` are the look's boxes; `detected` is the probability that one of the boxes is the
/// track's, `tempering` the look's where one is, `exponent` that of A between classes (update.h).
LookReasons reasonsOf(const Track& track, const std::vector<Shares>& shares, double detected,
                      double tempering, double exponent, const std::vector<std::size_t>& looked_at,
                      const std::vector<BoxDetection>& boxes, const FrameContext& frame);

/// Sets existence and books it.
void bookExistence(Track& track, double r, const LookReasons& reasons);
/// Divides the weights by their sum and books the classes. The numbers are sound.
void bookClasses(Track& track, const LookReasons& reasons);

}  // namespace perdure::semantic_filter
