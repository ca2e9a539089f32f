// Starts a map from a copy of another one.
#pragma once

#include <string>

namespace perdure::map_store {

/// Copies one committed state of `from` to `to`, which must not exist: complete and synced, or not
/// at all. Throws StartupError with the fix.
void copyMap(const std::string& from, const std::string& to);

}  // namespace perdure::map_store
