// Writes chunks to files that can be read alone. Continues when a full disk has space again.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/replay/recordings/mcap_writer.h"
#include "tools/record/segment_folder.h"

namespace perdure::tools {

using CatalogueNow = std::shared_ptr<const replay::mcap::Catalogue>;

/// A message at the start of each file, needed to interpret the others.
struct Latched {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::vector<std::uint8_t> data;
};
using LatchedNow = std::shared_ptr<const std::vector<Latched>>;

/// A packed chunk with the data needed to write it to any file.
struct PackedChunk {
  replay::mcap::Chunk chunk;
  CatalogueNow catalogue;
  LatchedNow latched;
  std::int64_t steady_ns = 0;  ///< steady time of its first message
};

class SegmentWriter {
 public:
  /// `segment_s`: seconds in each file; `word`: as in SegmentFolder.
  SegmentWriter(SegmentFolder& folder, double segment_s, std::string word);
  ~SegmentWriter();

  /// Returns false if the chunk could not be written and is lost; problem() has the reason.
  bool add(const PackedChunk& packed);
  void finish();

  /// The present problem as a sentence; empty if there is none.
  const std::string& problem() const { return problem_; }
  bool diskFull() const { return disk_full_; }
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t files() const { return files_; }

 private:
  bool begin(const PackedChunk& packed);
  bool addLatched(const PackedChunk& packed);
  bool hasRoomFor(const replay::mcap::Chunk& chunk);
  bool append(const replay::mcap::Chunk& chunk, const replay::mcap::Catalogue& catalogue);
  bool isOver(const PackedChunk& packed) const;
  bool note(const Result<void>& written);
  void finishLeftOver();

  SegmentFolder& folder_;
  const std::int64_t longest_ns_;
  const std::string word_;
  std::optional<replay::mcap::Writer> file_;
  std::int64_t began_ns_ = 0;
  std::vector<std::filesystem::path> left_over_;  // files that a full disk left unfinished
  std::string problem_;
  bool disk_full_ = false;
  std::uint64_t bytes_ = 0, files_ = 0;
};

}  // namespace perdure::tools
