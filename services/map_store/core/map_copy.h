// A map begun with all that another one holds.
#pragma once

#include <string>

namespace perdure::map_store {

/// Copies the map `from` to `to`, which must not exist: whole and synced, or not at all. `from` is
/// only read, and may be written by a service meanwhile: what was committed when the copy began is
/// in it. Older schemas stay what they are. Throws StartupError with the mend.
void copyMap(const std::string& from, const std::string& to);

}  // namespace perdure::map_store
