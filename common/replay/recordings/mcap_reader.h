// A recording's file as it is read: by its summary, or, where that is missing or wrong (a recorder
// that was killed, or a writer that leaves out what it may), by going through it record by record.
// Records of kinds that are not known are passed over, and so are bytes behind a record's last
// field. Any bytes are taken; nothing is believed that was not checked.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/replay/recordings/mcap_writer.h"

namespace perdure::replay::mcap {

using Records = std::shared_ptr<const std::vector<std::uint8_t>>;

/// A chunk that cannot be read, or not to its end.
struct Damage {
  std::uint64_t offset = 0;  ///< of its record in the file
  Reason reason;             ///< as Reader::unpack has it, without the file
};

class Reader {
 public:
  /// Reasons: "file", "not_mcap"; the detail says the mend.
  static Result<Reader> open(const std::filesystem::path& path);
  Reader(Reader&& other) noexcept;
  Reader& operator=(Reader&&) = delete;
  ~Reader();

  const std::filesystem::path& path() const { return path_; }
  /// Whether the file goes to its end: a footer and the magic, and no summary that is wrong.
  /// Otherwise all that is whole was found by looking.
  bool finished() const { return finished_; }
  /// Whether another recording begins where it ends, as `cat` leaves two: that one is not read.
  bool followed() const { return followed_; }
  const Catalogue& catalogue() const { return catalogue_; }
  const std::vector<ChunkIndex>& chunks() const { return chunks_; }
  const Statistics& statistics() const { return statistics_; }
  std::uint64_t size() const { return size_; }
  /// Of an unfinished file: bytes behind the last whole chunk.
  std::uint64_t cutBytes() const { return size_ - whole_; }
  /// Of a file that was gone through.
  const std::vector<Damage>& damage() const { return damage_; }
  /// Goes through every chunk that the summary names: damage() is of all then, and chunks() and
  /// statistics() are of what can be read.
  void check();

  /// The chunk's records. Reasons: "chunk_damaged", "chunk_of_other_compression",
  /// "chunk_too_large", "file".
  Result<Records> unpack(const ChunkIndex& chunk) const;

  /// Keeps no file open from now on; unpack() opens it each time.
  void letGo();

  /// Makes an unfinished file a finished one: cuts what is not whole (cutBytes), writes the
  /// summary. Refuses what finishable() does.
  Result<void> finish();
  /// Reasons: "followed" (by another recording, which would be lost), "not_chunked".
  Result<void> finishable() const;

 private:
  Reader(std::filesystem::path path, int file, std::uint64_t size)
      : path_(std::move(path)), file_(file), size_(size) {}
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
  std::vector<std::uint8_t> read(std::uint64_t at, std::uint64_t length) const;

  std::filesystem::path path_;
  int file_ = -1;
  std::uint64_t size_ = 0, whole_ = 0;
  std::vector<Damage> damage_;
  bool finished_ = false, by_summary_ = false, followed_ = false;
  Catalogue catalogue_;
  std::vector<ChunkIndex> chunks_;
  Statistics statistics_;
  Draft::Index last_index_;  ///< of the last chunk that the scan found
};

/// "FILE: 2 of 41 chunks cannot be read; the first, at byte 812: …", of one that has some.
std::string sentenceOfDamage(const std::filesystem::path& file, const Reader& reader);

/// That another recording follows the first one in `file`, and the mend.
std::string sentenceOfFollowed(const std::filesystem::path& file);

/// Goes through a chunk's records; false where they are damaged (what came before was given).
/// `other` gets schemas and channels.
bool forEachMessage(Bytes records,
                    const std::function<void(const Message&, std::uint64_t offset)>& visit,
                    Catalogue& other);

}  // namespace perdure::replay::mcap
