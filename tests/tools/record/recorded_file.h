// What tests of recordings share.
#pragma once

#include <filesystem>
#include <string>

#include "common/replay/recordings/mcap_reader.h"
#include "tests/process/support.h"

namespace perdure::tools {

inline std::string perdure() { return (test::programs() / "perdure").string(); }

/// What a file has: "finished", or why not.
inline std::string stateOf(const std::filesystem::path& file) {
  const auto reader = replay::mcap::Reader::open(file);
  return !reader ? reader.error().code : reader->finished() ? "finished" : "unfinished";
}

}  // namespace perdure::tools
