// What the map's graph says of anchors, loops and the body: all σ 0 is "not known"; states in
// words.
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

/// False: how well the body's place in M is known cannot be told. At the only anchor there is M
/// begins, so that it is exact.
inline bool hasCovariance(const MapFrame& frame) {
  return frame.anchors <= 1 || frame.covariance.diagonal().maxCoeff() > 0.0;
}

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
