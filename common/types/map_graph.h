// Properties of the anchors, loops and the body in the map's graph, and names of states. If all σ
// are 0, they are not known.
#pragma once

#include "common/types/map.h"

namespace perdure {

/// Returns true for the first anchor of the map. The σ of other anchors are relative to it; its own
/// are 0 and known.
inline bool isFirstOfMap(const MapAnchor& anchor) {
  return anchor.previous == 0 && anchor.session == anchor.map;
}
/// Returns whether the uncertainty of the anchor's pose is known.
inline bool hasSigma(const MapAnchor& anchor) {
  return isFirstOfMap(anchor) || anchor.sigma.maxCoeff() > 0.0;
}
inline bool hasSigma(const MapLoop& loop) { return loop.sigma.maxCoeff() > 0.0; }

/// Returns whether the uncertainty of the body's pose in M is known. If there is only one anchor, M
/// begins there, and the pose is exact.
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
