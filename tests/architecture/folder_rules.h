// How many units a folder may hold, so that its listing can be read at a glance.
#pragma once

#include <string>
#include <vector>

namespace perdure::tests {

/// A unit is NAME.h with NAME.cpp, or one of them.
inline constexpr std::size_t kMostUnits = 15;

/// A sentence about each folder that holds more. `paths` are those of files.
std::vector<std::string> overfullFolders(const std::vector<std::string>& paths);

}  // namespace perdure::tests
