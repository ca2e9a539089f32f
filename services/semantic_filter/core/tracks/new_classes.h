// Classes that a new model brings enter the objects that are there already (DESIGN 4, "Swapping
// inference"): at their prior, with the geometry that the object has, when the object is next seen.
#pragma once

#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// Gives the object hypotheses of classes that this frame's model knows and that it was never asked
/// about: of those as many, and by the same rule, as a birth from the box that shows it would
/// consider. True where its hypotheses changed: then it must be looked at again.
bool admitNewClasses(Object& object, const ObjectLook& look, const std::vector<Evidence>& boxes,
                     const FrameContext& frame);

}  // namespace perdure::semantic_filter
