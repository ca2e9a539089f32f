// Places of the ground where an object may stand that the map does not have: never seen, or not
// seen for long. Derivation: tools/docs/maths/expected_information.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/planning/expectation.h"

namespace perdure::semantic_filter {

/// Adds the places that `planned` views may show to the candidates, which are the objects of the
/// map. Each place has the size of the map's most frequent class. Its probability follows from the
/// density of objects around it and from `past`: the body's poses along the way, ordered by time.
/// Adds nothing if the map has no object or no past view, because then the density is not known.
void addPlaces(std::vector<Candidate>& candidates, const std::vector<TimedView>& past,
               const std::vector<TimedView>& planned, const Observer& observer);

}  // namespace perdure::semantic_filter
