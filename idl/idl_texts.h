// The .idl files as text, for recordings, which contain the schemas of their messages.
#pragma once

#include <span>
#include <string_view>

namespace perdure::idl {

struct File {
  std::string_view path;  ///< path in #include: "idl/base.idl"
  std::string_view text;
};
/// All files. A file follows the files that it includes.
std::span<const File> files();

}  // namespace perdure::idl
