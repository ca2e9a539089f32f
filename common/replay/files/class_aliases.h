// Names of classes as the world writes them, and as we do: lower-case, one name for one thing.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace perdure::replay {

class ClassAliases {
 public:
  /// Only lowers the case.
  ClassAliases() = default;
  /// From `config/class_aliases.yaml`: `canonical: [alias, …]`. Throws StartupError
  /// (kUnavailable where it is missing, kConfiguration with file:line:col where it is wrong).
  static ClassAliases load(const std::filesystem::path& file);

  /// The canonical, lower-case name; a name that nobody listed is only lower-cased.
  std::string canonical(std::string_view name) const;

 private:
  std::map<std::string, std::string> canonical_;  // from lower-case alias
};

}  // namespace perdure::replay
