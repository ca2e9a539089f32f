// Upper part: the visible part of an object whose lower part an unmapped object hides, as a table
// hides a chair. Such a hypothesis has the object's class and the part's cuboid, so the hidden part
// does not lower its likelihood again and again. Not in the paper. Derivation:
// tools/docs/maths/upper_part.md.
#pragma once

#include "services/semantic_filter/core/belief/classes/class_prior.h"
#include "services/semantic_filter/core/belief/state.h"

namespace perdure::semantic_filter {

/// Gaussian of log(l, w, h), log metres.
struct SizePrior {
  Eigen::Vector3d mean;
  Eigen::Matrix3d covariance;
};

/// Returns the size prior of an object or, if `upper_part`, of its upper part. The part has the
/// width of the object, any share of its length, and any share of its height up to a half.
SizePrior sizePriorOf(const ClassPrior& prior, bool upper_part);

/// Whether the cuboid has less than half of the height that is usual for its width. Only the cuboid
/// of an upper part has.
bool lessThanHalf(const Hypothesis& h, const ClassPrior& prior);

/// Returns the belief of the whole object. The top stays; height and length follow from the class,
/// given the visible part. Objects are upright along z of W, which is level to some degrees.
Hypothesis wholeOf(const Hypothesis& h, const ClassPrior& prior);

}  // namespace perdure::semantic_filter
