#include "tests/architecture/document_rules.h"

#include <algorithm>
#include <filesystem>
#include <regex>

namespace perdure::tests {
namespace {

/// Returns the first capture group of every match.
std::vector<std::string> found(const std::string& content, const char* pattern) {
  const std::regex expression(pattern);
  std::vector<std::string> all;
  for (std::sregex_iterator at(content.begin(), content.end(), expression), end; at != end; ++at) {
    all.push_back((*at)[1]);
  }
  return all;
}

bool endsOne(const std::set<std::string>& paths, const std::string& mention) {
  return std::any_of(paths.begin(), paths.end(), [&](const std::string& path) {
    return path == mention || path.ends_with("/" + mention);
  });
}

}  // namespace

std::vector<std::string> lostPaths(const std::string& document, const std::string& content,
                                   const std::set<std::string>& paths) {
  std::vector<std::string> lost;
  const auto folder = std::filesystem::path(document).parent_path();
  for (const std::string& link : found(content, R"(\]\(([^)#:\s]+)(#[^)\s]*)?\))")) {
    std::string path = (folder / link).lexically_normal().string();
    if (path.ends_with('/')) path.pop_back();
    if (!paths.contains(path)) lost.push_back(document + ": the link " + link + " leads nowhere");
  }
  for (const std::string& mention :
       found(content, R"(`([\w.-]+/[\w./-]+\.(h|cpp|idl|md|py|sh))`)")) {
    if (!endsOne(paths, mention)) lost.push_back(document + ": no file is " + mention);
  }
  return lost;
}

}  // namespace perdure::tests
