// Reads a recording's file by its summary. If the summary is missing or wrong, the file is scanned
// record by record. This happens after a crash of the recorder, or with writers that omit optional
// parts. Unknown records, and bytes after the last known field of a record, are skipped. Input may
// be arbitrary bytes; all values are checked before use.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/replay/recordings/mcap_writer.h"
#include "common/replay/recordings/read_file.h"

namespace perdure::replay::mcap {

using Records = std::shared_ptr<const std::vector<std::uint8_t>>;

/// A chunk that cannot be read completely.
struct Damage {
  std::uint64_t offset = 0;  ///< offset of its record in the file
  Reason reason;             ///< reason of Reader::unpack, without the name of the file
};

class Reader {
 public:
  /// Opens a recording. Reasons: "file", "not_mcap"; the detail states the fix.
  static Result<Reader> open(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return file_.path(); }
  /// Returns whether the file is complete: it ends with a footer and the magic, and its summary is
  /// not wrong. Otherwise a scan has found all complete records.
  bool finished() const { return finished_; }
  /// Returns whether another recording follows in the same file, as after `cat` of two files. The
  /// second one is not read.
  bool followed() const { return followed_; }
  const Catalogue& catalogue() const { return catalogue_; }
  const std::vector<ChunkIndex>& chunks() const { return chunks_; }
  const Statistics& statistics() const { return statistics_; }
  std::uint64_t size() const { return file_.size(); }
  /// Number of bytes after the last complete chunk of an unfinished file.
  std::uint64_t cutBytes() const { return size() - whole_; }
  /// The damaged chunks found by a scan or by check().
  const std::vector<Damage>& damage() const { return damage_; }
  /// Unpacks every chunk of the summary. damage() is then complete, and chunks() and statistics()
  /// describe the readable part.
  void check();

  /// The records of the chunk. Reasons: "chunk_damaged", "chunk_of_other_compression",
  /// "chunk_too_large", "file".
  Result<Records> unpack(const ChunkIndex& chunk) const;

  /// Closes the file; from now on unpack() opens it for each call.
  void letGo() { file_.letGo(); }

  /// Completes an unfinished file: cuts incomplete data (cutBytes) and writes the summary. Fails
  /// with the reasons of finishable().
  Result<void> finish();
  /// Returns whether finish() is possible. Reasons: "followed" (by another recording, which would
  /// be lost), "not_chunked".
  Result<void> finishable() const;

 private:
  explicit Reader(ReadFile file) : file_(std::move(file)) {}
  enum class Summary { kHolds, kTooLittle, kWrong };
  Summary readSummary();
  Summary takeSummary(Bytes records);
  bool plausible() const;
  bool describesAll() const;
  bool scan();
  bool endsAt(std::uint64_t end);
  bool scanRecord(Op op, std::uint64_t at, std::uint64_t length);
  bool scanChunk(std::uint64_t at, std::uint64_t length);
  Result<Records> recordsOf(const ChunkIndex& chunk) const;
  bool countMessages(const Records& records);
  void scanMessageIndex(std::uint64_t at, std::uint64_t length, Bytes content);
  void addBare(std::uint64_t at, std::uint64_t length);

  ReadFile file_;
  std::uint64_t whole_ = 0;
  std::vector<Damage> damage_;
  bool finished_ = false, by_summary_ = false, followed_ = false;
  Catalogue catalogue_;
  std::vector<ChunkIndex> chunks_;
  Statistics statistics_;
  Draft::Index last_index_;  ///< index of the last chunk found by the scan
};

/// Describes the damage of a file: "FILE: 2 of 41 chunks cannot be read; the first, at byte 812:
/// …".
std::string sentenceOfDamage(const std::filesystem::path& file, const Reader& reader);

/// States that another recording follows the first one in `file`, with the fix.
std::string sentenceOfFollowed(const std::filesystem::path& file);

/// Visits the messages in a chunk's records. Returns false if they are damaged; earlier messages
/// have been visited then. `other` receives schemas and channels.
bool forEachMessage(Bytes records,
                    const std::function<void(const Message&, std::uint64_t offset)>& visit,
                    Catalogue& other);

}  // namespace perdure::replay::mcap
