#include "common/replay/recordings/mcap_writer.h"

#include <fcntl.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <memory>

#include "common/base/check.h"

namespace perdure::replay::mcap {
namespace {

constexpr char kLibrary[] = "perdure";
constexpr char kZstd[] = "zstd";

Result<Descriptor> opened(const std::filesystem::path& path, int flags) {
  Descriptor file(open(path.c_str(), flags | O_CLOEXEC, 0644));
  if (file.open()) return file;
  return fail("file", "{}: {}", path.c_str(), std::strerror(errno));
}

std::vector<std::uint8_t> beginning(const std::string& profile = {}) {
  std::vector<std::uint8_t> bytes(kMagic.begin(), kMagic.end()), header;
  Put{header}(profile);
  Put{header}(kLibrary);
  Put(bytes).record(Op::kHeader, header);
  return bytes;
}

std::vector<std::uint8_t> compressed(const std::vector<std::uint8_t>& records) {
  constexpr int kFastest = 1;
  static thread_local const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(
      ZSTD_createCCtx(), &ZSTD_freeCCtx);
  std::vector<std::uint8_t> bytes(ZSTD_compressBound(records.size()));
  const std::size_t n = ZSTD_compressCCtx(context.get(), bytes.data(), bytes.size(), records.data(),
                                          records.size(), kFastest);
  check(ZSTD_isError(n) == 0, "zstd packs into a buffer of its own bound");
  bytes.resize(n);
  return bytes;
}

/// Appends the indexes and records their offsets in `place`; `at` is the file offset of `to`.
void putIndexes(std::vector<std::uint8_t>& to, std::uint64_t at, const Draft::Index& index,
                ChunkIndex& place) {
  const std::size_t before = to.size();
  for (const auto& [channel, entries] : index) {
    place.index_offsets[channel] = at + to.size();
    std::vector<std::uint8_t> content;
    Put put(content);
    put(channel);
    put(static_cast<std::uint32_t>(entries.size() * 2 * sizeof(std::uint64_t)));
    for (const auto& [log_ns, offset] : entries) {
      put(log_ns);
      put(offset);
    }
    Put(to).record(Op::kMessageIndex, content);
  }
  place.index_length = to.size() - before;
}

/// Builds the summary section: group() calls `put` for each group of records, and adds the group's
/// offset.
class Summary {
 public:
  explicit Summary(std::uint64_t at) : at_(at) {}
  void group(Op op, auto put) {
    const std::size_t before = bytes_.size();
    put(bytes_);
    if (bytes_.size() == before) return;
    std::vector<std::uint8_t> content;
    Put{content}(static_cast<std::uint8_t>(op));
    Put{content}(at_ + before);
    Put{content}(static_cast<std::uint64_t>(bytes_.size() - before));
    Put(offsets_).record(Op::kSummaryOffset, content);
  }
  /// Returns the summary with the footer and the magic. The footer's checksum covers all bytes from
  /// the start of the summary up to itself.
  std::vector<std::uint8_t> finished() {
    const std::uint64_t offsets_at = at_ + bytes_.size();
    Put put(bytes_);
    put.bytes(offsets_);
    put(static_cast<std::uint8_t>(Op::kFooter));
    put(static_cast<std::uint64_t>(kFooterContent));
    put(at_);
    put(offsets_at);
    put(crc(bytes_));
    put.bytes(kMagic);
    return std::move(bytes_);
  }

 private:
  std::uint64_t at_;
  std::vector<std::uint8_t> bytes_, offsets_;
};

}  // namespace

ExitCode exitCodeOf(const Reason& reason) {
  return reason.code == "disk_full" ? ExitCode::kInputOutput : ExitCode::kUnavailable;
}

void Draft::add(const Message& message) {
  start_ns_ = std::min(start_ns_, message.log_ns);
  end_ns_ = std::max(end_ns_, message.log_ns);
  index_[message.channel].emplace_back(message.log_ns, records_.size());
  putMessage(records_, message);
  ++messages_;
}

std::size_t Chunk::bytes() const { return record.size() + messages * 2 * sizeof(std::uint64_t); }

Chunk pack(const Draft& draft) {
  const auto packed = compressed(draft.records());
  Chunk chunk;
  chunk.messages = draft.messages();
  chunk.index = draft.index();
  chunk.place.start_ns = draft.startNs();
  chunk.place.end_ns = draft.endNs();
  chunk.place.compression = kZstd;
  chunk.place.packed = packed.size();
  chunk.place.unpacked = draft.bytes();
  std::vector<std::uint8_t> content;
  content.reserve(packed.size() + 64);
  Put put(content);
  put(draft.startNs());
  put(draft.endNs());
  put(static_cast<std::uint64_t>(draft.bytes()));
  put(crc(draft.records()));
  put(kZstd);
  put(static_cast<std::uint64_t>(packed.size()));
  put.bytes(packed);
  Put(chunk.record).record(Op::kChunk, content);
  chunk.place.length = chunk.record.size();
  return chunk;
}

Result<Writer> Writer::create(const std::filesystem::path& path, const std::string& profile) {
  auto file = opened(path, O_WRONLY | O_CREAT | O_EXCL);
  if (!file) return tl::unexpected(file.error());
  Writer writer(path, *std::move(file));
  if (auto written = writer.write(beginning(profile)); !written) {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    return tl::unexpected(written.error());
  }
  return writer;
}

Result<Writer> Writer::resume(const std::filesystem::path& path, std::uint64_t end,
                              const Catalogue& catalogue, std::vector<ChunkIndex> chunks,
                              const Statistics& counted) {
  auto file = opened(path, O_WRONLY);
  if (!file) return tl::unexpected(file.error());
  Writer writer(path, *std::move(file));
  if (ftruncate(writer.file_.get(), static_cast<off_t>(end)) != 0) {
    return fail("file", "{}: {}", path.c_str(), std::strerror(errno));
  }
  writer.size_ = end;
  writer.catalogue_ = catalogue;
  writer.chunks_ = std::move(chunks);
  writer.statistics_ = counted;
  if (end > 0) return writer;
  if (auto written = writer.write(beginning()); !written) return tl::unexpected(written.error());
  return writer;
}

Result<void> Writer::write(const std::vector<std::uint8_t>& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = pwrite(file_.get(), bytes.data() + done, bytes.size() - done,
                             static_cast<off_t>(size_ + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      const int error = n < 0 ? errno : ENOSPC;
      if (ftruncate(file_.get(), static_cast<off_t>(size_)) != 0) {
        return fail("file", "{}: {}", path_.c_str(), std::strerror(errno));
      }
      const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
      return fail(full ? "disk_full" : "file", "{}: {}", path_.c_str(), std::strerror(error));
    }
    done += static_cast<std::size_t>(n);
  }
  size_ += bytes.size();
  return {};
}

Result<void> Writer::append(const Chunk& chunk, const Catalogue& catalogue) {
  std::vector<std::uint8_t> bytes;
  Catalogue added;
  for (const auto& [id, entries] : chunk.index) {
    if (catalogue_.channels.contains(id)) continue;
    const Channel& channel = catalogue.channels.at(id);
    const Schema& schema = catalogue.schemas.at(channel.schema);
    if (!catalogue_.schemas.contains(schema.id) && added.schemas.emplace(schema.id, schema).second)
      putRecord(bytes, schema);
    putRecord(bytes, channel);
    added.channels.emplace(id, channel);
  }
  ChunkIndex place = chunk.place;
  place.offset = size_ + bytes.size();
  Put(bytes).bytes(chunk.record);
  putIndexes(bytes, size_, chunk.index, place);
  if (auto written = write(bytes); !written) return written;
  catalogue_.schemas.merge(added.schemas);
  catalogue_.channels.merge(added.channels);
  const bool first = statistics_.messages == 0;
  statistics_.start_ns = first ? place.start_ns : std::min(statistics_.start_ns, place.start_ns);
  statistics_.end_ns = std::max(statistics_.end_ns, place.end_ns);
  statistics_.messages += chunk.messages;
  for (const auto& [id, entries] : chunk.index) statistics_.by_channel[id] += entries.size();
  chunks_.push_back(std::move(place));
  return {};
}

Result<void> Writer::appendIndex(ChunkIndex& chunk, const Draft::Index& index) {
  std::vector<std::uint8_t> bytes;
  chunk.index_offsets.clear();
  putIndexes(bytes, size_, index, chunk);
  if (auto written = write(bytes); !written) return written;
  chunks_.push_back(chunk);
  return {};
}

std::vector<std::uint8_t> Writer::summary() const {
  std::vector<std::uint8_t> end{static_cast<std::uint8_t>(Op::kDataEnd), 4, 0, 0, 0, 0, 0, 0, 0};
  Put{end}(std::uint32_t{0});  // no checksum of the data section, because each chunk has one
  Statistics statistics = statistics_;
  statistics.schemas = static_cast<std::uint16_t>(catalogue_.schemas.size());
  statistics.channels = static_cast<std::uint32_t>(catalogue_.channels.size());
  statistics.chunks = static_cast<std::uint32_t>(chunks_.size());
  Summary summary(size_ + end.size());
  summary.group(Op::kSchema, [&](auto& to) {
    for (const auto& [id, schema] : catalogue_.schemas) putRecord(to, schema);
  });
  summary.group(Op::kChannel, [&](auto& to) {
    for (const auto& [id, channel] : catalogue_.channels) putRecord(to, channel);
  });
  summary.group(Op::kStatistics, [&](auto& to) { putRecord(to, statistics); });
  summary.group(Op::kChunkIndex, [&](auto& to) {
    for (const ChunkIndex& chunk : chunks_) putRecord(to, chunk);
  });
  Put(end).bytes(summary.finished());
  return end;
}

Result<void> Writer::finish() { return write(summary()); }

void Writer::sync() const { fdatasync(file_.get()); }

}  // namespace perdure::replay::mcap
