// How a hypothesis moves: a random walk at rest, or constant velocity with white acceleration
// (Bar-Shalom, Li 2001, ch. 6). Derivation: tools/docs/maths/state_and_mixture.md.
#pragma once

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

/// Returns the probability that a moving hypothesis is faster than `speed`, m/s.
double fasterThan(const Hypothesis& h, double speed);
/// Returns the probability that an existing track moves faster than `min_speed`, m/s.
double movingProbability(const Track& track, double min_speed);

/// Applies motion and process noise of `dt` seconds.
void predictHypothesis(Hypothesis& h, double dt, const MotionParameters& m);

/// Conditions the hypothesis on v = 0. This also corrects the position, because part of its error
/// was taken for motion.
void stop(Hypothesis& h);
/// Called when the track leaves the view. Splits moving hypotheses that are probably slower than
/// `min_speed` (m/s): the slow share stops where it was, the fast share moves on.
void stopSlowHypotheses(Track& track, double min_speed);
/// Returns x after `dt` seconds: static hypotheses stay, moving ones go on at constant velocity.
State stateAt(const Hypothesis& h, double dt);
/// Returns the track as its motion predicts it for `time`; as_of does not change. For publishing.
Track extrapolated(Track track, TimePoint time, const MotionParameters& parameters);

/// Returns a moving copy of a hypothesis at rest, for an object that may just be starting to move.
Hypothesis asMoving(Hypothesis at_rest);

}  // namespace perdure::semantic_filter
