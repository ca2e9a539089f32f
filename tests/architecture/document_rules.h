// Rule for documents: every file that a document names exists.
#pragma once

#include <set>
#include <string>
#include <vector>

namespace perdure::tests {

/// Returns one sentence for each mention that does not resolve. A mention is a relative link, or a
/// path in back-quotes that has a slash and no placeholder. A path resolves if some path of the
/// project ends with it. `document` and `paths` (files and folders) are relative to the project's
/// root.
std::vector<std::string> lostPaths(const std::string& document, const std::string& content,
                                   const std::set<std::string>& paths);

}  // namespace perdure::tests
