// Fuses the maps of several drives and vehicles into one. Their sessions are aligned by loops,
// which a replay of each session along its anchors finds. Beliefs about identical objects are
// fused.
//
// There are no files, threads or clock. The same maps in the same order give the same result, and
// adding a map a second time changes nothing. Derivation: tools/docs/maths/fusion.md.
#pragma once

#include <cstddef>
#include <vector>

#include "common/mapping/fusion/map_contents.h"
#include "common/mapping/parameters.h"

namespace perdure::mapping {

/// The result of adding one map.
struct FusionReport {
  std::vector<WorldId> added, grown;  ///< sessions, by their worlds in the fused map
  std::vector<WorldId> parted;        ///< continued differently in two maps; one of them is used
  std::size_t known = 0;              ///< sessions with nothing new
  std::size_t objects = 0;            ///< objects added, without history
  std::size_t renewed = 0;            ///< known objects with later observations
  std::size_t loops = 0;              ///< loop closures between new and earlier sessions
  std::size_t merges = 0;             ///< added objects that were identified with known ones
  std::vector<Change> changes;        ///< new changes
};

/// Adds `other` to `map`; both must have at least one session. If the first map is the one that
/// comes first (comesFirst), the result does not depend on the order of the others.
FusionReport fuseInto(MapContents& map, const MapContents& other, const Parameters& parameters);

/// Sessions grouped by component, the component with most anchors first.
std::vector<std::vector<WorldId>> partsOf(const MapContents& map);

}  // namespace perdure::mapping
