// Recognises binary files that a program copied in text mode (FTP, version control on Windows).
#pragma once

#include <cstddef>
#include <string_view>

namespace perdure {

inline constexpr char kCopiedAsText[] =
    "was copied in text mode, which writes CR LF for each line feed; copy it again in binary mode";

/// Whether each of at least 16 line feeds follows a carriage return, as in no binary file.
inline bool wasCopiedAsText(std::string_view bytes) {
  constexpr std::size_t kFewest = 16;
  std::size_t feeds = 0;
  for (std::size_t at = bytes.find('\n'); at != bytes.npos; at = bytes.find('\n', at + 1)) {
    if (at == 0 || bytes[at - 1] != '\r') return false;
    ++feeds;
  }
  return feeds >= kFewest;
}

}  // namespace perdure
