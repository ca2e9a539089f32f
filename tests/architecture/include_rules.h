// Rules for the layers of the project, checked on include lines.
#pragma once

#include <string>
#include <vector>

namespace perdure::tests {

/// Returns one sentence for each forbidden include or use. `path` is relative to the project's
/// root.
std::vector<std::string> violations(const std::string& path, const std::string& content);

}  // namespace perdure::tests
