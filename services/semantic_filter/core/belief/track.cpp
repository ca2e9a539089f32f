#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

double certainty(const Object& object, const TendParameters& parameters) {
  return object.found_again ? parameters.certain_again : parameters.certain;
}

}  // namespace perdure::semantic_filter
