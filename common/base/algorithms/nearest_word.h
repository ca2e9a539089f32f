// The word that a mistyped one was meant to be.
#pragma once

#include <string>
#include <vector>

namespace perdure {

/// The first of the candidates with the fewest edits (insert, delete, replace, swap of neighbours);
/// empty if all need more than a third of the word's length, and more than two.
std::string nearestWord(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace perdure
