#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

double existenceCeiling(const Track& track, const TrackParameters& parameters) {
  return track.detected_on_revisit ? parameters.certain_again : parameters.certain;
}

}  // namespace perdure::semantic_filter
