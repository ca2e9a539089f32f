// Starts a map from a copy of another one.
#pragma once

#include <string>

namespace perdure::map_store {

/// Copies the map `from` to `to`, which must not exist: complete and synced, or not at all. `from`
/// is only read; a service may write to it meanwhile. The copy has the state that was committed
/// when it began. Older schemas are not upgraded. Throws StartupError with the fix.
void copyMap(const std::string& from, const std::string& to);

}  // namespace perdure::map_store
