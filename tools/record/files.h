// What can be done with recordings that lie there: `perdure record info`, `repair`, `export`.
#pragma once

#include <filesystem>

#include "common/base/result.h"
#include "common/replay/recordings/recorded_messages.h"

namespace CLI {
class App;
}

namespace perdure::tools {

void addFileCommands(CLI::App& record);

/// A copy of one recording or a folder of them in which every message is plain XCDR1 (its types
/// final), for readers without delimited XCDR2. What cannot be read is counted. Throws
/// StartupError.
ReasonCounts exportPlain(const std::filesystem::path& from, const std::filesystem::path& to);

/// Of a recording that gave no message: throws StartupError(kData) with the reason that it has.
[[noreturn]] void refuseNothing(const replay::RecordedMessages& recording,
                                const std::filesystem::path& path);

}  // namespace perdure::tools
