// Upper part: what is seen of an object whose lower part something off the map hides, as a table a
// chair. Such a hypothesis has the object's class and the part's cuboid, so that it pays for the
// hiding thing once. Beyond the paper. Derivation: tools/docs/maths/upper_part.md.
#pragma once

#include "services/semantic_filter/core/belief/classes/class_prior.h"
#include "services/semantic_filter/core/belief/state.h"

namespace perdure::semantic_filter {

/// Gaussian of log(l, w, h), log metres.
struct SizePrior {
  Eigen::Vector3d mean;
  Eigen::Matrix3d covariance;
};

/// Returns the prior of the cuboid of an object, or of its upper part: any share of the length and
/// of the height up to a half, and the width of the object.
SizePrior sizePriorOf(const ClassPrior& prior, bool upper_part);

/// Whether it has less than half of the usual height, as only the cuboid of an upper part has.
bool lessThanHalf(const Hypothesis& h, const ClassPrior& prior);

/// Returns the belief of the whole object: the top stays; height and length follow from the class,
/// given what is seen. Objects are upright along z of W, which is level to some degrees.
Hypothesis wholeOf(const Hypothesis& h, const ClassPrior& prior);

}  // namespace perdure::semantic_filter
