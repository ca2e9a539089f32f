// What the σ of anchors and loops of the map's graph say: all 0 is "not known".
#pragma once

#include "common/types/map.h"

namespace perdure {

/// The others' σ are relative to it; its own are 0.
inline bool isFirstOfMap(const MapAnchor& anchor) {
  return anchor.previous == 0 && anchor.session == anchor.map;
}
/// False: how well its place is known cannot be told.
inline bool hasSigma(const MapAnchor& anchor) {
  return isFirstOfMap(anchor) || anchor.sigma.maxCoeff() > 0.0;
}
inline bool hasSigma(const MapLoop& loop) { return loop.sigma.maxCoeff() > 0.0; }

}  // namespace perdure
