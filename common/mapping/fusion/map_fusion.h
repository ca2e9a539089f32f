// Fuses the maps of several drives and vehicles into one. A replay of each session along its
// anchors finds loops, which align the sessions. Beliefs about the same object are fused.
//
// The code uses no files, threads or clock. The same maps in the same order give the same result. A
// map that is added twice has no further effect. Derivation: tools/docs/maths/fusion.md.
#pragma once

#include <cstddef>
#include <vector>

#include "common/mapping/fusion/map_contents.h"
#include "common/mapping/parameters.h"

namespace perdure::mapping {

/// The result of adding one map.
struct FusionReport {
  std::vector<WorldId> added, grown;     ///< sessions, by their worlds in the fused map
  std::vector<WorldId> parted;           ///< continued differently in two maps; one continuation is
                                         ///< used
  std::size_t known = 0;                 ///< sessions with nothing new
  std::size_t objects = 0;               ///< objects added, without history
  std::size_t renewed = 0;               ///< known objects with later observations
  std::size_t loops = 0;                 ///< loop closures between new and earlier sessions
  std::size_t merges = 0;                ///< added objects that were identified with known ones
  std::size_t corrections_left_out = 0;  ///< beyond kMostCorrections
  std::vector<Change> changes;           ///< new changes
};

/// Adds `other` to `map`; both must have at least one session. The order in which the others are
/// added does not matter if the first of all is the one that comesFirst() selects. Exception: it
/// decides which corrections beyond kMostCorrections are left out.
FusionReport fuseInto(MapContents& map, const MapContents& other, const Parameters& parameters);

/// Returns sessions grouped by component, in descending order of the component's number of anchors.
std::vector<std::vector<WorldId>> partsOf(const MapContents& map);

}  // namespace perdure::mapping
