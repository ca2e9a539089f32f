#include "tests/architecture/vocabulary_rules.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <sstream>

namespace perdure::tests {
namespace {

/// Earlier words of the project and their replacements in tools/docs/glossary.md, without words
/// that plain sentences need.
const std::map<std::string, std::string> kFormer{{"footing", "ground contact"},
                                                 {"facing", "heading"},
                                                 {"screened", "unmapped occluder"},
                                                 {"elusive", "detectability"},
                                                 {"remnant", "partial view"},
                                                 {"remnants", "partial view"},
                                                 {"alike", "correlation, or lookalike"},
                                                 {"doubt", "robust weight"},
                                                 {"doubts", "robust weight"},
                                                 {"look", "observation, score or keyframe"},
                                                 {"looks", "observations, scores or keyframes"},
                                                 {"birth", "initiation"},
                                                 {"births", "initiation"},
                                                 {"born", "initiated"},
                                                 {"bear", "initiate"},
                                                 {"rebirth", "re-initialisation"},
                                                 {"tend", "track management"},
                                                 {"tends", "track management"},
                                                 {"buried", "deleted"},
                                                 {"reveal", "occlusion revision"},
                                                 {"foresee", "reappearance time"},
                                                 {"glimpse", "keyframe"},
                                                 {"sight", "visibility"},
                                                 {"sights", "visibility"},
                                                 {"twin", "hypothesis"},
                                                 {"twins", "hypotheses"},
                                                 {"pace", "speed prior"},
                                                 {"smoothed", "MAP fit"},
                                                 {"reunite", "re-identify"}};

bool isLetter(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// Returns the words of a line with a lower-case first letter. A name in camelCase or snake_case is
/// one word.
std::vector<std::string> wordsOf(const std::string& line) {
  std::vector<std::string> words;
  for (auto at = line.begin(); at != line.end();) {
    at = std::find_if(at, line.end(), isLetter);
    const auto end = std::find_if_not(at, line.end(), isLetter);
    if (at != end) words.emplace_back(at, end);
    at = end;
  }
  for (std::string& word : words) {
    word[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(word[0])));
  }
  return words;
}

}  // namespace

std::vector<std::string> formerWords(const std::string& path, const std::string& content) {
  std::vector<std::string> found;
  std::istringstream lines(content);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    for (const std::string& word : wordsOf(line)) {
      const auto former = kFormer.find(word);
      if (former == kFormer.end()) continue;
      found.push_back(path + ":" + std::to_string(number) + ": '" + word + "' is now " +
                      former->second + " (tools/docs/glossary.md)");
    }
  }
  return found;
}

}  // namespace perdure::tests
