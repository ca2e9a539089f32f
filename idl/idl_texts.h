// The .idl files as text, for recordings, which carry the schemas of what they hold.
#pragma once

#include <span>
#include <string_view>

namespace perdure::idl {

struct File {
  std::string_view path;  ///< as #include names it: "idl/base.idl"
  std::string_view text;
};
/// What a file includes stands before it.
std::span<const File> files();

}  // namespace perdure::idl
