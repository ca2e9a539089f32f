// Attribution: the division of one update of existence and PMF among its causes, for the ledger
// (the paper has no such account). Derivation: tools/docs/maths/ledger.md.
#pragma once

#include <vector>

#include "common/base/scratch.h"
#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// A of one hypothesis, and its division among "none of the boxes" and each box.
struct Shares {
  double A = 1.0;             ///< P(frame | hypothesis) / P(frame | nothing there)
  double none = 1.0;          ///< β_0, posterior share of "none of the boxes"
  ScratchVector<double> box;  ///< β_z, posterior share of each gated box
};

using AllShares = ScratchVector<Shares>;  ///< one for each hypothesis of a track

/// The reasons of an observation. They are computed before the weights change.
struct UpdateReasons {
  ExistenceEvidence kind = ExistenceEvidence::kHit;
  double excused = 0.0;  ///< nats of a miss that an unmapped occluder excuses, >= 0
  /// At a hit: the gain of log π of each class by the activations of the network, nats.
  ClassNumbers activation;
};

/// Returns the reasons of one update. `detected`: probability that a box is the track's.
/// `tempering`: exponent τ of a hit. `exponent`: exponent of A between classes. `gated`: indices of
/// the boxes near the track.
UpdateReasons reasonsOf(const Track& track, const AllShares& shares, double detected,
                        double tempering, double exponent, const ScratchVector<std::size_t>& gated,
                        const std::vector<BoxDetection>& boxes, const FrameContext& frame);

/// Sets existence to `r` and enters its reasons in the ledger.
void bookExistence(Track& track, double r, const UpdateReasons& reasons);
/// Normalises the weights of a sound track and enters the reasons of the PMF in the ledger.
void bookClasses(Track& track, const UpdateReasons& reasons);

}  // namespace perdure::semantic_filter
