// Rule for the filter's core: it does not use the former words of tools/docs/glossary.md.
#pragma once

#include <string>
#include <vector>

namespace perdure::tests {

/// Returns one sentence for each word of the glossary's column "formerly" in `content` (code or
/// comments). Only whole words count. `path` is relative to the project's root.
std::vector<std::string> formerWords(const std::string& path, const std::string& content);

}  // namespace perdure::tests
