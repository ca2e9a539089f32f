#include <sstream>

#include "common/wire/cdr.h"
#include "idl/idl_texts.h"

namespace perdure::wire {
namespace {

constexpr std::string_view kInclude = "#include \"";

const idl::File* fileOf(std::string_view struct_name) {
  const std::string declaration = "struct " + std::string(struct_name) + " {";
  for (const idl::File& file : idl::files()) {
    if (file.text.find(declaration) != std::string_view::npos) return &file;
  }
  return nullptr;
}

/// Returns the text of the included files (idl/README.md), followed by that of the file.
std::string inlined(const idl::File& file) {
  std::string before, text;
  std::istringstream lines{std::string(file.text)};
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(kInclude)) {
      text += line + "\n";
      continue;
    }
    const std::string path = line.substr(kInclude.size(), line.rfind('"') - kInclude.size());
    for (const idl::File& other : idl::files()) {
      if (other.path == path) before += inlined(other);
    }
  }
  return before + text;
}

}  // namespace

std::string idlOf(std::string_view type_name) {
  constexpr std::string_view kModule = "perdure::msg::";
  if (!type_name.starts_with(kModule)) return {};
  const idl::File* file = fileOf(type_name.substr(kModule.size()));
  return file ? inlined(*file) : std::string();
}

}  // namespace perdure::wire
