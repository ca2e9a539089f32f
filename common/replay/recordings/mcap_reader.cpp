#include "common/replay/recordings/mcap_reader.h"

#include <algorithm>

#include "common/replay/recordings/unpack.h"

namespace perdure::replay::mcap {
namespace {

constexpr char kBare[] = "bare";  ///< marks a message record outside chunks
constexpr std::uint64_t kMostContent = 64u
                                       << 20;  ///< largest size of records other than chunks, bytes

/// The header of a chunk, before its records.
struct ChunkHead {
  ChunkIndex place;
  std::uint32_t crc = 0;
  std::uint64_t records_at = 0;  ///< offset from the start of the content
};

std::optional<ChunkHead> chunkHeadFrom(Bytes content) {
  Take take(content);
  ChunkHead head;
  ChunkIndex& place = head.place;
  const bool whole = take(place.start_ns) && take(place.end_ns) && take(place.unpacked) &&
                     take(head.crc) && take(place.compression) && take(place.packed);
  head.records_at = content.size() - take.rest().size();
  return whole ? std::optional(head) : std::nullopt;
}

Result<std::vector<std::uint8_t>> unpacked(const ChunkHead& head, Bytes packed) {
  const ChunkIndex& place = head.place;
  if (place.unpacked > kMostRecords) {
    return fail("chunk_too_large", "a chunk of " + std::to_string(place.unpacked) + " bytes");
  }
  std::vector<std::uint8_t> records;
  if (place.compression.empty()) {
    records.assign(packed.begin(), packed.end());
  } else if (place.compression == "zstd") {
    records = unpackedZstd(packed, place.unpacked);
  } else if (place.compression == "lz4") {
    records = unpackedLz4(packed, place.unpacked);
  } else {
    return fail("chunk_of_other_compression",
                "chunks packed by " + place.compression +
                    " are not read; `mcap compress --compression zstd` packs them anew");
  }
  if (records.size() != place.unpacked) {
    return fail("chunk_damaged", "a chunk that does not unpack to its size");
  }
  if (head.crc != 0 && crc(records) != head.crc)
    return fail("chunk_damaged", "a chunk with a wrong checksum");
  return records;
}

/// Adds a schema or a channel; ignores other records. Returns false if it is malformed.
bool addTo(Catalogue& catalogue, const Record& record) {
  const auto add = [&]<class M>(std::map<std::uint16_t, M>& to) {
    const auto one = recordFrom<M>(record.content);
    if (one) to.emplace(one->id, *one);
    return one.has_value();
  };
  if (record.op == Op::kSchema) return add(catalogue.schemas);
  return record.op != Op::kChannel || add(catalogue.channels);
}

const Reason kEndsWithinRecord{"chunk_damaged", "a chunk ends within a record"};

}  // namespace

std::string sentenceOfDamage(const std::filesystem::path& file, const Reader& reader) {
  const auto& damage = reader.damage();
  const auto& first = damage.front();
  const auto read = static_cast<std::size_t>(
      std::count_if(reader.chunks().begin(), reader.chunks().end(), [&](const auto& chunk) {
        return std::none_of(damage.begin(), damage.end(),
                            [&](const auto& one) { return one.offset == chunk.offset; });
      }));
  return file.string() + ": " + std::to_string(damage.size()) + " of " +
         std::to_string(read + damage.size()) + " chunks cannot be read; the first, at byte " +
         std::to_string(first.offset) + ": " + first.reason.detail;
}

std::string sentenceOfFollowed(const std::filesystem::path& file) {
  return file.string() +
         " holds a second recording behind the first one, which is not read; keep each in a file "
         "of its own, in one folder";
}

bool forEachMessage(Bytes records, const std::function<void(const Message&, std::uint64_t)>& visit,
                    Catalogue& other) {
  const std::size_t size = records.size();
  while (!records.empty()) {
    const std::uint64_t offset = size - records.size();
    const auto record = takeRecord(records);
    if (!record) return false;
    if (record->op == Op::kMessage) {
      const auto message = messageFrom(record->content);
      if (!message) return false;
      visit(*message, offset);
    } else {
      addTo(other, *record);
    }
  }
  return true;
}

Result<Reader> Reader::open(const std::filesystem::path& path) {
  auto file = ReadFile::open(path);
  if (!file) return tl::unexpected(file.error());
  Reader reader(*std::move(file));
  const auto magic = reader.file_.read(0, kMagic.size());
  const bool begun = std::equal(magic.begin(), magic.end(), kMagic.begin());
  if (!begun || (magic.size() < kMagic.size() && reader.size() > 0)) {
    return fail("not_mcap",
                path.string() + " is no MCAP file; recordings come from perdure record");
  }
  const Summary summary = reader.readSummary();
  reader.finished_ = reader.by_summary_ = summary == Summary::kHolds;
  if (!reader.finished_) reader.finished_ = reader.scan() && summary == Summary::kTooLittle;
  if (reader.finished_) reader.whole_ = reader.size();
  return reader;
}

/// Reads the summary. If optional parts (the whole summary, statistics, indexes) are missing,
/// returns kTooLittle, not kWrong.
Reader::Summary Reader::readSummary() {
  constexpr std::uint64_t kEnd = kRecordHead + kFooterContent + kMagic.size();
  if (size() < kMagic.size() + kEnd) return Summary::kTooLittle;
  const std::uint64_t footer_at = size() - kEnd;
  const auto end = file_.read(footer_at, kEnd);
  Bytes rest(end);
  const auto footer = takeRecord(rest);
  if (!footer || footer->op != Op::kFooter || !std::equal(rest.begin(), rest.end(), kMagic.begin()))
    return Summary::kTooLittle;
  Take take(footer->content);
  std::uint64_t summary_at = 0, offsets_at = 0;
  std::uint32_t checksum = 0;
  const bool whole = take(summary_at) && take(offsets_at) && take(checksum);
  if (whole && summary_at == 0) return Summary::kTooLittle;
  if (!whole || summary_at < kMagic.size() || summary_at > footer_at) return Summary::kWrong;
  if (footer_at - summary_at > kMostContent) return Summary::kWrong;
  const std::uint64_t covered = size() - summary_at - kMagic.size() - sizeof checksum;
  const auto summary = file_.read(summary_at, covered);
  if (summary.size() != covered || (checksum != 0 && crc(summary) != checksum))
    return Summary::kWrong;
  return takeSummary(Bytes(summary).first(footer_at - summary_at));
}

Reader::Summary Reader::takeSummary(Bytes records) {
  bool counted = false;
  while (!records.empty()) {
    const auto record = takeRecord(records);
    if (!record) return Summary::kWrong;
    if (!addTo(catalogue_, *record)) return Summary::kWrong;
    if (record->op == Op::kChunkIndex) {
      const auto chunk = recordFrom<ChunkIndex>(record->content);
      if (!chunk) return Summary::kWrong;
      chunks_.push_back(*chunk);
    } else if (record->op == Op::kStatistics) {
      const auto statistics = recordFrom<Statistics>(record->content);
      if (!statistics) return Summary::kWrong;
      statistics_ = *statistics;
      counted = true;
    }
  }
  if (!plausible()) return Summary::kWrong;
  return counted && describesAll() ? Summary::kHolds : Summary::kTooLittle;
}

/// Returns whether all chunks lie within the file.
bool Reader::plausible() const {
  return std::all_of(chunks_.begin(), chunks_.end(), [this](const ChunkIndex& chunk) {
    return chunk.offset >= kMagic.size() && chunk.offset <= size() && chunk.length >= kRecordHead &&
           chunk.length <= size() - chunk.offset;
  });
}

/// Returns whether the summary alone locates all messages with their channels and schemas.
bool Reader::describesAll() const {
  if (statistics_.messages == 0) return true;
  return !chunks_.empty() && chunks_.size() == statistics_.chunks &&
         catalogue_.channels.size() == statistics_.channels &&
         catalogue_.schemas.size() == statistics_.schemas;
}

/// Scans the records. Returns true if it reached the footer and the final magic at the end of the
/// file.
bool Reader::scan() {
  catalogue_ = {};
  chunks_.clear();
  statistics_ = {};
  std::uint64_t at = whole_ = std::min<std::uint64_t>(size(), kMagic.size());
  bool in_data = true;
  while (at + kRecordHead <= size()) {
    const auto head = file_.read(at, kRecordHead);
    Take take(head);
    std::uint8_t op = 0;
    std::uint64_t length = 0;
    if (!take(op) || !take(length) || op == 0) return false;
    if (length > size() - at - kRecordHead) return false;  // truncated
    const std::uint64_t end = at + kRecordHead + length;
    if (static_cast<Op>(op) == Op::kFooter) return endsAt(end);
    if (static_cast<Op>(op) == Op::kDataEnd) in_data = false;
    if (in_data && !scanRecord(static_cast<Op>(op), at, length)) return false;
    at = end;
  }
  return false;
}

bool Reader::endsAt(std::uint64_t end) {
  const auto magic = file_.read(end, kMagic.size());
  const auto next = file_.read(end + kMagic.size(), kMagic.size());
  if (!std::equal(magic.begin(), magic.end(), kMagic.begin(), kMagic.end())) return false;
  followed_ = std::equal(next.begin(), next.end(), kMagic.begin(), kMagic.end());
  return next.empty();
}

/// Returns false if the record is invalid, so that the rest of the file cannot be interpreted.
bool Reader::scanRecord(Op op, std::uint64_t at, std::uint64_t length) {
  if (op == Op::kChunk) return scanChunk(at, length);
  if (op == Op::kHeader && chunks_.empty()) whole_ = at + kRecordHead + length;
  if (op != Op::kSchema && op != Op::kChannel && op != Op::kMessage && op != Op::kMessageIndex) {
    return true;
  }
  if (length > kMostContent) return false;
  const auto content = file_.read(at + kRecordHead, length);
  if (content.size() != length) return false;
  if (!addTo(catalogue_, {op, content})) return false;
  if (op == Op::kMessage) {
    addBare(at, length);
  } else if (op == Op::kMessageIndex) {
    scanMessageIndex(at, length, content);
  }
  return true;
}

bool Reader::scanChunk(std::uint64_t at, std::uint64_t length) {
  ChunkIndex place;
  place.offset = at;
  place.length = kRecordHead + length;
  const auto records = recordsOf(place);
  if (!records) {
    damage_.push_back({at, records.error()});
    return true;
  }
  constexpr std::uint64_t kHead = 256;
  const auto content = file_.read(at + kRecordHead, std::min(length, kHead));
  const auto head = chunkHeadFrom(content);
  if (!head) return false;
  place = head->place;
  place.offset = at;
  place.length = kRecordHead + length;
  if (!countMessages(*records)) damage_.push_back({at, kEndsWithinRecord});
  statistics_.start_ns =
      chunks_.empty() ? place.start_ns : std::min(statistics_.start_ns, place.start_ns);
  statistics_.end_ns = std::max(statistics_.end_ns, place.end_ns);
  chunks_.push_back(place);
  whole_ = at + place.length;
  return true;
}

/// Adds a chunk's messages to the statistics and to last_index_. Returns false if the data end
/// within a record.
bool Reader::countMessages(const Records& records) {
  last_index_.clear();
  const auto visit = [&](const Message& message, std::uint64_t offset) {
    last_index_[message.channel].emplace_back(message.log_ns, offset);
    ++statistics_.by_channel[message.channel];
    ++statistics_.messages;
  };
  return forEachMessage(*records, visit, catalogue_);
}

void Reader::check() {
  if (!by_summary_) return;
  by_summary_ = false;
  statistics_.messages = 0;
  statistics_.by_channel.clear();
  std::erase_if(chunks_, [this](const ChunkIndex& chunk) {
    const auto records = recordsOf(chunk);
    if (!records) {
      damage_.push_back({chunk.offset, records.error()});
    } else if (!countMessages(*records)) {
      damage_.push_back({chunk.offset, kEndsWithinRecord});
    }
    return !records;
  });
}

void Reader::scanMessageIndex(std::uint64_t at, std::uint64_t length, Bytes content) {
  Take take(content);
  std::uint16_t channel = 0;
  if (chunks_.empty() || !take(channel) || !last_index_.contains(channel)) return;
  ChunkIndex& chunk = chunks_.back();
  chunk.index_offsets[channel] = at;
  chunk.index_length += kRecordHead + length;
  if (chunk.index_offsets.size() == last_index_.size()) whole_ = at + kRecordHead + length;
}

/// Adds a message record outside chunks. Minimal writers produce such records.
void Reader::addBare(std::uint64_t at, std::uint64_t length) {
  const auto message = messageFrom(file_.read(at + kRecordHead, length));
  if (!message) return;
  ChunkIndex place{message->log_ns, message->log_ns, at, kRecordHead + length, {}, 0, kBare};
  chunks_.push_back(place);
  last_index_.clear();
  ++statistics_.messages;
  ++statistics_.by_channel[message->channel];
  whole_ = at + place.length;
}

Result<Records> Reader::unpack(const ChunkIndex& chunk) const {
  auto records = recordsOf(chunk);
  if (records) return records;
  return fail(records.error().code, path().string() + ": " + records.error().detail + " (at byte " +
                                        std::to_string(chunk.offset) + ")");
}

Result<Records> Reader::recordsOf(const ChunkIndex& chunk) const {
  if (chunk.length > kMostRecords + kMostContent) {
    return fail("chunk_too_large", "a chunk of " + std::to_string(chunk.length) + " bytes");
  }
  auto bytes = file_.read(chunk.offset, chunk.length);
  if (chunk.compression == kBare) {
    return std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
  }
  Bytes rest(bytes);
  const auto record = takeRecord(rest);
  const auto head =
      record && record->op == Op::kChunk ? chunkHeadFrom(record->content) : std::nullopt;
  if (!head || head->place.packed > record->content.size() - head->records_at) {
    return fail("chunk_damaged", "no whole chunk");
  }
  auto records = unpacked(*head, record->content.subspan(head->records_at, head->place.packed));
  if (!records) return tl::unexpected(records.error());
  return std::make_shared<const std::vector<std::uint8_t>>(*std::move(records));
}

Result<void> Reader::finishable() const {
  if (followed_) return fail("followed", sentenceOfFollowed(path()));
  const bool bare = std::any_of(chunks_.begin(), chunks_.end(),
                                [](const auto& chunk) { return chunk.compression == kBare; });
  if (!bare) return {};
  return fail("not_chunked",
              path().string() + " holds messages outside of chunks; it reads as it is");
}

Result<void> Reader::finish() {
  if (finished_) return {};
  if (auto can = finishable(); !can) return can;
  std::vector<ChunkIndex> chunks = chunks_;
  const bool lacks_index =
      !chunks.empty() && chunks.back().index_offsets.size() != last_index_.size();
  std::optional<ChunkIndex> last;
  std::uint64_t end = whole_ <= kMagic.size() ? 0 : whole_;  // 0: rewrite the whole file
  if (lacks_index) {
    last = chunks.back();
    last->index_length = 0;
    chunks.pop_back();
  }
  auto writer = Writer::resume(path(), end, catalogue_, std::move(chunks), statistics_);
  if (!writer) return tl::unexpected(writer.error());
  if (last) {
    if (auto written = writer->appendIndex(*last, last_index_); !written) return written;
  }
  if (auto written = writer->finish(); !written) return written;
  writer->sync();
  return {};
}

}  // namespace perdure::replay::mcap
