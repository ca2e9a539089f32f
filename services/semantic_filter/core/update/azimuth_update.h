// The network's azimuth as a measurement of the length axis (modulo 180°) and of the heading: it
// changes yaw, heading and the weights of yaw modes. (The paper uses azimuths at initiation only:
// "Initialization", line 284.) Derivation: tools/docs/maths/azimuth_and_heading.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/update/attribution.h"

namespace perdure::semantic_filter {

struct AzimuthMatch {
  double residual = 0.0;  ///< rad, to the nearer of the two turns (0 or 180°)
  bool same_head = true;
  double likelihood = 0.0;  ///< of the azimuth, over a half turn, 1/rad
  double inlier = 0.0;      ///< probability that the azimuth carries information
};

/// Compares an azimuth (rad) with the yaw of x. `variance`: of azimuth and yaw together, rad².
AzimuthMatch matchAzimuth(double azimuth, const State& x, const View& view, double variance);

/// Returns the gain of the log-odds of the heading by one such azimuth, nats.
double headingOdds(const AzimuthMatch& match);

/// Returns the standard deviation of an azimuth before learning, rad. `told`: as the network
/// reports it, rad.
double azimuthSigma(double told, const ClassPrior& prior);

/// Updates the yaw (modulo 180°) by an EKF and the heading by its log-odds. `azimuth`, `sigma`:
/// rad. `weight`: in (0, 1]. Returns the likelihood of the azimuth, 1/rad, which may change the
/// weights of yaw modes only.
double updateWithAzimuth(Hypothesis& h, double azimuth, double sigma, double weight,
                         const FrameContext& frame);

/// Updates all hypotheses by the azimuths of possible boxes, with the exponent √`tempering`.
void updateAzimuths(Track& track, const AllShares& shares, double tempering,
                    const ScratchVector<std::size_t>& gated, const std::vector<BoxDetection>& boxes,
                    const FrameContext& frame);

}  // namespace perdure::semantic_filter
