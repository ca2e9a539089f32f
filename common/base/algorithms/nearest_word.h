// Finds the known word that is most similar to a mistyped word.
#pragma once

#include <string>
#include <vector>

namespace perdure {

/// Returns the candidate with the fewest edits (insert, delete, replace, swap of neighbours); the
/// first of several. Returns an empty string if every candidate needs more than two edits and more
/// edits than a third of the word's length.
std::string nearestWord(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace perdure
