// Rule for the filter's core: it uses the words of tools/docs/glossary.md, not earlier ones.
#pragma once

#include <string>
#include <vector>

namespace perdure::tests {

/// Returns one sentence for each earlier word of the project in `content` (code or comments). Only
/// whole words count. `path` is relative to the project's root.
std::vector<std::string> formerWords(const std::string& path, const std::string& content);

}  // namespace perdure::tests
