// Maps of several drives and vehicles as one: their sessions side by side, aligned by the loops
// that a replay of each along its anchors finds, and what they know of the same objects fused.
//
// No files, threads or clock. The same maps in the same order give the same map, and one that is
// brought a second time changes nothing.
// Derivation: tools/docs/maths/fusion.md.
#pragma once

#include <cstddef>
#include <vector>

#include "common/mapping/fusion/map_contents.h"
#include "common/mapping/parameters.h"

namespace perdure::mapping {

/// What became of a map that was brought.
struct FusionReport {
  std::vector<WorldId> added, grown;  ///< sessions, by their worlds in the fused map
  std::vector<WorldId> parted;        ///< continued differently in two maps; the rest is left out
  std::size_t known = 0;              ///< sessions with nothing new
  std::size_t objects = 0;            ///< that were added, history not counted
  std::size_t renewed = 0;            ///< known ones that were seen again since
  std::size_t loops = 0;              ///< closed between what is new and the rest
  std::size_t merges = 0;             ///< objects that turned out to be known ones
  std::vector<Change> changes;        ///< that are new
};

/// Brings `other` into `map`; both must have at least one session. Where it begins with a map that
/// comes first (comesFirst) the result does not depend on an order.
FusionReport fuseInto(MapContents& map, const MapContents& other, const Parameters& parameters);

/// Sessions by the component that they belong to; the largest, by anchors, first.
std::vector<std::vector<WorldId>> partsOf(const MapContents& map);

}  // namespace perdure::mapping
