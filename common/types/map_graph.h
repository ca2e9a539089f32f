// What anchors and loops of the map's graph say: all σ 0 is "not known"; states in words.
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

inline const char* nameOf(MapLoopState state) {
  switch (state) {
    case MapLoopState::kTentative:
      return "tentative";
    case MapLoopState::kConfirmed:
      return "confirmed";
    case MapLoopState::kWithdrawn:
      return "withdrawn";
  }
  return "";
}

}  // namespace perdure
