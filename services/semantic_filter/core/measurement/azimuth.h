// The network's azimuth as a measurement of yaw. It measures the direction of the length axis
// (modulo 180°) and, separately, the heading. The paper uses it at initiation only
// ("Initialization"). Some azimuths carry no information, and some are turned by 180°. Derivation:
// tools/docs/maths/azimuth_and_heading.md.
#pragma once

#include "services/semantic_filter/core/belief/classes/class_prior.h"
#include "services/semantic_filter/core/measurement/cuboid_projection.h"

namespace perdure::semantic_filter {

struct AzimuthMatch {
  double residual = 0.0;  ///< rad, to the nearer of the two turns (0 or 180°)
  bool same_head = true;
  double likelihood = 0.0;  ///< of the azimuth, over a half turn, 1/rad
  double inlier = 0.0;      ///< probability that the azimuth carries information
};

/// `azimuth`: rad. `variance`: of the azimuth and of the yaw together, rad².
AzimuthMatch matchAzimuth(double azimuth, const State& x, const View& view, double variance);

/// Returns what one such azimuth adds to the log-odds of the heading, nats.
double headingOdds(const AzimuthMatch& match);

/// Returns the deviation of an azimuth, rad, as assumed before learning. `told`: what the network
/// says, rad.
double azimuthSigma(double told, const ClassPrior& prior);

}  // namespace perdure::semantic_filter
