// Bars of the scenes that the filter does not pass yet, and why.
#pragma once

#include <map>
#include <string>

namespace perdure::test {

/// By the bar's name; a scene with vio is "toy vio".
std::map<std::string, std::string> notYet(const std::string& scene);

}  // namespace perdure::test
