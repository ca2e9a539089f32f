// Maps class names of external data to the names used here: lower-case, one name per class.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace perdure::replay {

class ClassAliases {
 public:
  /// Without aliases, names are only converted to lower case.
  ClassAliases() = default;
  /// Reads `config/class_aliases.yaml`: `canonical: [alias, …]`. Throws StartupError: kUnavailable
  /// if the file is missing, kConfiguration with file:line:col if it is invalid.
  static ClassAliases load(const std::filesystem::path& file);

  /// Returns the canonical, lower-case name. An unlisted name is only converted to lower case.
  std::string canonical(std::string_view name) const;

 private:
  std::map<std::string, std::string> canonical_;  // key: lower-case alias
};

}  // namespace perdure::replay
