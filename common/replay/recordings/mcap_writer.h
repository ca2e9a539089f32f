// Writes recordings: compressed and indexed chunks of messages, followed by the summary. Written
// data remain readable if the writer ends at any time; at most the last chunk is truncated.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "common/base/process/descriptor.h"
#include "common/base/result.h"
#include "common/replay/recordings/mcap_format.h"

namespace perdure::replay::mcap {

/// Schemas and channels of the messages, by id.
struct Catalogue {
  std::map<std::uint16_t, Schema> schemas = {};
  std::map<std::uint16_t, Channel> channels = {};
};

/// Consecutive messages of a short period, not compressed yet.
class Draft {
 public:
  /// Messages are added in the order of arrival; log times must not decrease.
  void add(const Message& message);
  bool empty() const { return index_.empty(); }
  std::size_t bytes() const { return records_.size(); }
  std::uint64_t messages() const { return messages_; }
  std::uint64_t startNs() const { return start_ns_; }
  std::uint64_t endNs() const { return end_ns_; }
  const std::vector<std::uint8_t>& records() const { return records_; }
  /// Log time and offset of each message, by channel.
  using Index = std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>>;
  const Index& index() const { return index_; }

 private:
  std::vector<std::uint8_t> records_;
  Index index_;
  std::uint64_t start_ns_ = UINT64_MAX, end_ns_ = 0, messages_ = 0;
};

/// A compressed chunk, independent of the file.
struct Chunk {
  ChunkIndex place;                  ///< offsets not yet set
  std::vector<std::uint8_t> record;  ///< complete record of the chunk
  Draft::Index index;
  std::uint64_t messages = 0;

  std::size_t bytes() const;  ///< approximate memory
};
/// Compresses a draft with zstd at the fastest level.
Chunk pack(const Draft& draft);

/// Returns the exit status for a reason of Writer.
ExitCode exitCodeOf(const Reason& reason);

class Writer {
 public:
  /// Creates a file. Reasons: "file", "disk_full". The detail is the system's error message. No
  /// file remains after a failure.
  static Result<Writer> create(const std::filesystem::path& path, const std::string& profile = {});
  /// Opens an existing file and truncates it at `end`. `chunks` and `counted` describe the data
  /// before `end`.
  static Result<Writer> resume(const std::filesystem::path& path, std::uint64_t end,
                               const Catalogue& catalogue, std::vector<ChunkIndex> chunks,
                               const Statistics& counted);

  /// Writes the chunk, after those of its schemas and channels that the file does not have yet. On
  /// failure ("disk_full", "file") the file is restored, and the call may be repeated.
  Result<void> append(const Chunk& chunk, const Catalogue& catalogue);
  /// Writes the missing message indexes of a chunk in the file.
  Result<void> appendIndex(ChunkIndex& chunk, const Draft::Index& index);
  /// Writes the summary. Fails as append() does.
  Result<void> finish();
  /// Returns after all written data are on disk.
  void sync() const;

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  const Statistics& statistics() const { return statistics_; }

 private:
  Writer(std::filesystem::path path, Descriptor file)
      : path_(std::move(path)), file_(std::move(file)) {}
  Result<void> write(const std::vector<std::uint8_t>& bytes);
  std::vector<std::uint8_t> summary() const;

  std::filesystem::path path_;
  Descriptor file_;
  std::uint64_t size_ = 0;
  Catalogue catalogue_;
  std::vector<ChunkIndex> chunks_;
  Statistics statistics_;
};

}  // namespace perdure::replay::mcap
