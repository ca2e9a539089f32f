#include "tests/architecture/folder_rules.h"

#include <filesystem>
#include <map>
#include <set>

namespace perdure::tests {
std::vector<std::string> overfullFolders(const std::vector<std::string>& paths) {
  std::map<std::string, std::set<std::string>> units;
  for (const std::filesystem::path path : paths) {
    units[path.parent_path().string()].insert(path.stem().string());
  }
  std::vector<std::string> found;
  for (const auto& [folder, names] : units) {
    if (names.size() <= kMostUnits) continue;
    found.push_back(folder + " holds " + std::to_string(names.size()) + " units, more than " +
                    std::to_string(kMostUnits) + ": give it sub-folders that say what they hold");
  }
  return found;
}

}  // namespace perdure::tests
