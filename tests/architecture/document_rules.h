// Documents name files that are there: a file that moves takes its mentions with it.
#pragma once

#include <set>
#include <string>
#include <vector>

namespace perdure::tests {

/// A sentence for each relative link of a document that leads to nothing, and for each path of a
/// source or document in back-quotes (a slash in it, no placeholder) with which no file's path
/// ends. `document` and `paths`, of files and folders, are relative to the project's root.
std::vector<std::string> lostPaths(const std::string& document, const std::string& content,
                                   const std::set<std::string>& paths);

}  // namespace perdure::tests
