// Finds the known word that is most similar to a mistyped word.
#pragma once

#include <string>
#include <vector>

namespace perdure {

/// The candidate with the fewest edits (insert, delete, replace, swap of neighbours); the first of
/// several. Empty if all need more than two edits and more than a third of the word's length.
std::string nearestWord(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace perdure
