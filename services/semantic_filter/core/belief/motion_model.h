// How a hypothesis moves: at rest with a random walk, or at constant velocity.
#pragma once

#include <optional>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

/// Probability that a moving hypothesis is faster than `speed`, m/s.
double fasterThan(const Hypothesis& h, double speed);
/// Probability that the track moves faster than `min_speed`, given that it exists.
double movingProbability(const Track& track, double min_speed);

/// Process noise and motion over `dt` seconds.
void predictHypothesis(Hypothesis& h, double dt, const MotionParameters& m);

/// The hypothesis given that v = 0: what it took for motion was the error of its place.
void stop(Hypothesis& h);
/// When the track gets out of visibility: what is more likely slower than `min_speed` may as well
/// stand, and then it stays where it was. Divides such hypotheses by their speed.
void stopSlowHypotheses(Track& track, double min_speed);
/// x at a later time: static ones stay, moving ones go on at constant velocity.
State stateAt(const Hypothesis& h, double dt);
/// Where its motion alone will have brought it by `time`, as_of left as it was: for what is said of
/// it between two looks. Not kept, so that the belief itself depends on its looks only.
Track extrapolated(Track track, TimePoint time, const MotionParameters& parameters);

/// One at rest as it may just be driving off.
Hypothesis asMoving(Hypothesis at_rest);

}  // namespace perdure::semantic_filter
