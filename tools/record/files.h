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
/// Of one whose messages are none that can be exported: the same; `reasons` say why.
[[noreturn]] void refuseForeign(const std::filesystem::path& path, const ReasonCounts& reasons);

/// A file that was begun: removed again, unless it is kept.
class NewFile {
 public:
  explicit NewFile(std::filesystem::path file) : file_(std::move(file)) {}
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  void keep() { whole_ = true; }

 private:
  std::filesystem::path file_;
  bool whole_ = false;
};

}  // namespace perdure::tools
