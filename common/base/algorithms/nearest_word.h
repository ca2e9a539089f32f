// Finds the known word that is most similar to a mistyped word.
#pragma once

#include <string>
#include <vector>

namespace perdure {

/// The candidate with the fewest edits; empty if all need more than two and a third of the length.
std::string nearestWord(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace perdure
