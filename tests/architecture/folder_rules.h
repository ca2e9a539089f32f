// Rule for the size of folders: a folder holds at most a fixed number of units.
#pragma once

#include <string>
#include <vector>

namespace perdure::tests {

/// Largest number of units in a folder. A unit is NAME.h, NAME.cpp, or both.
inline constexpr std::size_t kMostUnits = 15;

/// Returns one sentence for each folder that holds more units. `paths` are paths of files.
std::vector<std::string> overfullFolders(const std::vector<std::string>& paths);

}  // namespace perdure::tests
