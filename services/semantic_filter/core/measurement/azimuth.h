// A network's azimuth as a measurement of yaw: of the way a cuboid lies (modulo 180°) and, apart
// from that, of where its head is. Some azimuths say nothing, some are turned by 180°.
#pragma once

#include "services/semantic_filter/core/belief/class_prior.h"
#include "services/semantic_filter/core/measurement/cuboid_projection.h"

namespace perdure::semantic_filter {

struct AzimuthMatch {
  double residual = 0.0;  ///< rad, of the turn (0 or 180°) that is nearer
  bool same_head = true;
  double likelihood = 0.0;  ///< of the azimuth, over a half turn, 1/rad
  double inlier = 0.0;      ///< probability that it says something
};

/// `variance` is that of the azimuth and of the yaw together, rad².
AzimuthMatch matchAzimuth(double azimuth, const State& x, const View& view, double variance);

/// Nats for the head that one such azimuth speaks for.
double headingOdds(const AzimuthMatch& match);

/// Of an azimuth of which the network says `told`, rad, as is assumed at first.
double azimuthSigma(double told, const ClassPrior& prior);

}  // namespace perdure::semantic_filter
