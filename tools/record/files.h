// Operations on recorded files: `perdure record info`, `repair` and `export`.
#pragma once

#include <filesystem>
#include <vector>

#include "common/base/result.h"
#include "common/replay/recordings/recorded_messages.h"

namespace CLI {
class App;
}

namespace perdure::tools {

void addFileCommands(CLI::App& record);

/// Copies a recording, or a folder of recordings, with every message as plain XCDR1 (final types),
/// for readers without delimited XCDR2. Returns the counts of messages that cannot be read. Throws
/// StartupError if nothing can be exported.
ReasonCounts exportPlain(const std::filesystem::path& from, const std::filesystem::path& to);

/// Converts a recording to ROS 2: MCAP with profile ros2 and the topics of common/ros/mirror.h.
ReasonCounts exportRos2(const std::filesystem::path& from, const std::filesystem::path& to);

/// Completes unfinished recordings. If bytes must be removed, the original stays as
/// FILE.before-repair. Throws StartupError, after all files, if one could not be repaired.
void repairAll(const std::vector<std::filesystem::path>& paths);

/// Throws StartupError(kData) with the reason why the recording has no messages.
[[noreturn]] void refuseNothing(const replay::RecordedMessages& recording,
                                const std::filesystem::path& path);
/// Throws StartupError(kData) for a recording whose messages cannot be exported; `reasons` are
/// counted causes.
[[noreturn]] void refuseForeign(const std::filesystem::path& path, const ReasonCounts& reasons);

/// A new file, which the destructor removes unless it is kept.
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
