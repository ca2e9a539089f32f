// Recordings as they are written: chunks of messages, packed and indexed, and at the end the
// summary. What was written stays readable whenever the writer dies: at most the last chunk is cut.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "common/base/result.h"
#include "common/replay/recordings/mcap_format.h"

namespace perdure::replay::mcap {

/// What messages refer to, by id.
struct Catalogue {
  std::map<std::uint16_t, Schema> schemas = {};
  std::map<std::uint16_t, Channel> channels = {};
};

/// Messages of a short time, one after the other, not yet packed.
class Draft {
 public:
  /// In the order of arrival; log times do not go back.
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

/// A packed chunk, as it goes into any file.
struct Chunk {
  ChunkIndex place;                  ///< offsets not yet set
  std::vector<std::uint8_t> record;  ///< the chunk's record, whole
  Draft::Index index;
  std::uint64_t messages = 0;

  std::size_t bytes() const;  ///< of memory, about
};
/// By zstd, fastest level.
Chunk pack(const Draft& draft);

/// Of a Writer's reason.
ExitCode exitCodeOf(const Reason& reason);

class Writer {
 public:
  /// A new file. Reasons: "file", "disk_full" (the detail is the system's); none is left then.
  static Result<Writer> create(const std::filesystem::path& path, const std::string& profile = {});
  /// An existing one, from `end` on: what is behind is cut off. `chunks` and `counted` are what
  /// stands before.
  static Result<Writer> resume(const std::filesystem::path& path, std::uint64_t end,
                               const Catalogue& catalogue, std::vector<ChunkIndex> chunks,
                               const Statistics& counted);
  Writer(Writer&& other) noexcept;
  Writer& operator=(Writer&& other) noexcept;
  ~Writer();

  /// Writes the chunk and those of its schemas and channels that are new to this file. Where that
  /// fails ("disk_full", "file") the file is as before, and it may be tried again.
  Result<void> append(const Chunk& chunk, const Catalogue& catalogue);
  /// Writes the message indexes that a chunk which stands in the file still lacks.
  Result<void> appendIndex(ChunkIndex& chunk, const Draft::Index& index);
  /// Writes the summary; the same.
  Result<void> finish();
  /// What was written is on the disk when this returns.
  void sync() const;

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  const Statistics& statistics() const { return statistics_; }

 private:
  Writer(std::filesystem::path path, int file) : path_(std::move(path)), file_(file) {}
  Result<void> write(const std::vector<std::uint8_t>& bytes);
  std::vector<std::uint8_t> summary() const;

  std::filesystem::path path_;
  int file_ = -1;
  std::uint64_t size_ = 0;
  Catalogue catalogue_;
  std::vector<ChunkIndex> chunks_;
  Statistics statistics_;
};

}  // namespace perdure::replay::mcap
