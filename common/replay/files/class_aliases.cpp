#include "common/replay/files/class_aliases.h"

#include <yaml-cpp/yaml.h>

#include "common/base/errors.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

[[noreturn]] void complain(const std::filesystem::path& file, const YAML::Mark& mark,
                           const std::string& what) {
  throw StartupError(ExitCode::kConfiguration, file.string() + ":" + std::to_string(mark.line + 1) +
                                                   ":" + std::to_string(mark.column + 1) + ": " +
                                                   what);
}

YAML::Node loadYaml(const std::filesystem::path& file) {
  try {
    return YAML::LoadFile(file.string());
  } catch (const YAML::BadFile&) {
    throw StartupError(ExitCode::kUnavailable, file.string() +
                                                   " cannot be read; name the folder that holds "
                                                   "class_aliases.yaml in PERDURE_CONFIG_DIR");
  } catch (const YAML::ParserException& error) {
    complain(file, error.mark, error.msg);
  }
}

}  // namespace

ClassAliases ClassAliases::load(const std::filesystem::path& file) {
  ClassAliases aliases;
  const YAML::Node root = loadYaml(file);
  if (!root.IsMap()) complain(file, root.Mark(), "write `name: [alias, …]`, one line a class");
  for (const auto& entry : root) {
    if (!entry.first.IsScalar())
      complain(file, entry.first.Mark(), "the name of a class is a word");
    const auto name = toLower(entry.first.Scalar());
    if (!entry.second.IsSequence()) {
      complain(file, entry.second.Mark(), name + ": write a list of aliases, [a, b]");
    }
    for (const auto& alias : entry.second) {
      if (!alias.IsScalar()) complain(file, alias.Mark(), name + ": an alias is a word");
      const auto [at, is_new] = aliases.canonical_.emplace(toLower(alias.Scalar()), name);
      if (!is_new && at->second != name) {
        complain(file, alias.Mark(), at->first + ": is an alias of " + at->second + " already");
      }
    }
  }
  return aliases;
}

std::string ClassAliases::canonical(std::string_view name) const {
  std::string lower = toLower(trim(name));
  const auto found = canonical_.find(lower);
  return found == canonical_.end() ? lower : found->second;
}

}  // namespace perdure::replay
