// The layers of the project as rules on include lines.
#pragma once

#include <string>
#include <vector>

namespace perdure::tests {

/// Sentences about what a file must not include or use. `path` is relative to the project's root.
std::vector<std::string> violations(const std::string& path, const std::string& content);

}  // namespace perdure::tests
