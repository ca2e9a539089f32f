// Copies a map, for example as the start of a new one.
#pragma once

#include <string>

namespace perdure::map_store {

/// Copies the map `from` to `to`, complete and synced, or not at all. `to` must not exist. `from`
/// is only read, and a service may write to it meanwhile. The copy has the state committed when
/// copying began, in the same schema version. Throws StartupError with the fix.
void copyMap(const std::string& from, const std::string& to);

}  // namespace perdure::map_store
