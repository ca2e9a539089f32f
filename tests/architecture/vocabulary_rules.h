// The words of tools/docs/glossary.md as a rule: the filter's core does not go back to its old
// ones.
#pragma once

#include <string>
#include <vector>

namespace perdure::tests {

/// A sentence for each word of the glossary's column "formerly" that stands in `content`, code or
/// comment, as a whole word. `path` is relative to the project's root.
std::vector<std::string> formerWords(const std::string& path, const std::string& content);

}  // namespace perdure::tests
