// Support for tests of recordings.
#pragma once

#include <filesystem>
#include <string>

#include "common/replay/recordings/mcap_reader.h"
#include "tests/process/support.h"

namespace perdure::tools {

inline std::string perdure() { return (test::programs() / "perdure").string(); }

/// Returns the state of a file: "finished", "unfinished", or an error code.
inline std::string stateOf(const std::filesystem::path& file) {
  const auto reader = replay::mcap::Reader::open(file);
  return !reader ? reader.error().code : reader->finished() ? "finished" : "unfinished";
}

}  // namespace perdure::tools
