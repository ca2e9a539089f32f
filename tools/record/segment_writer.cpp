#include "tools/record/segment_writer.h"

#include <algorithm>

#include "common/replay/recordings/mcap_reader.h"

namespace perdure::tools {

namespace mcap = replay::mcap;

SegmentWriter::SegmentWriter(SegmentFolder& folder, double segment_s, std::string word)
    : folder_(folder),
      longest_ns_(static_cast<std::int64_t>(segment_s * 1e9)),
      word_(std::move(word)) {}

SegmentWriter::~SegmentWriter() { finish(); }

bool SegmentWriter::note(const Result<void>& written) {
  problem_ = written ? "" : written.error().detail;
  disk_full_ = !written && written.error().code == "disk_full";
  return written.has_value();
}

/// A file ends after its duration, at the size limit, or at an eighth of the quota.
bool SegmentWriter::isOver(const PackedChunk& packed) const {
  constexpr std::uint64_t kFilesOfQuota = 8;
  constexpr std::uint64_t kSummary = 1u << 20;  // bytes: schemas, and 250 for each of 1000 chunks
  const std::uint64_t limit = folder_.largestFile();
  const std::uint64_t end = file_->size() + packed.chunk.bytes() + std::min(kSummary, limit / 4);
  const bool large =
      end > limit || (folder_.quota() > 0 && file_->size() > folder_.quota() / kFilesOfQuota);
  return large || packed.steady_ns - began_ns_ >= longest_ns_;
}

bool SegmentWriter::begin(const PackedChunk& packed) {
  if (!hasRoomFor(packed.chunk)) return false;
  const auto path = folder_.nextFile(static_cast<std::int64_t>(packed.chunk.place.start_ns), word_);
  auto file = mcap::Writer::create(path);
  bool begun = note(file ? Result<void>() : tl::unexpected(file.error()));
  if (begun) {
    file_ = *std::move(file);
    begun = addLatched(packed);
  }
  if (!begun) {
    file_.reset();
    folder_.remove(path);
    return false;
  }
  began_ns_ = packed.steady_ns;
  ++files_;
  finishLeftOver();
  return true;
}

bool SegmentWriter::addLatched(const PackedChunk& packed) {
  if (packed.latched->empty()) return true;
  mcap::Draft draft;
  for (const Latched& message : *packed.latched) {
    const std::uint64_t at = packed.chunk.place.start_ns;
    draft.add({message.channel, message.sequence, at, at, message.data});
  }
  return append(mcap::pack(draft), *packed.catalogue);
}

bool SegmentWriter::hasRoomFor(const mcap::Chunk& chunk) {
  return folder_.hasRoomFor(chunk.bytes()) || note(fail("disk_full", "the disk is full"));
}

bool SegmentWriter::append(const mcap::Chunk& chunk, const mcap::Catalogue& catalogue) {
  if (!hasRoomFor(chunk)) return false;
  const std::uint64_t before = file_->size();
  if (!note(file_->append(chunk, catalogue))) return false;
  file_->sync();
  bytes_ += file_->size() - before;
  folder_.sizeIs(file_->path(), file_->size());
  folder_.keepQuota();
  return true;
}

bool SegmentWriter::add(const PackedChunk& packed) {
  if (file_ && isOver(packed)) finish();
  if (!file_ && !begin(packed)) return false;
  return append(packed.chunk, *packed.catalogue);
}

void SegmentWriter::finish() {
  if (!file_) return;
  if (file_->finish()) {
    file_->sync();
    folder_.sizeIs(file_->path(), file_->size());
  } else {
    left_over_.push_back(file_->path());
  }
  file_.reset();
}

void SegmentWriter::finishLeftOver() {
  std::erase_if(left_over_, [](const auto& path) {
    auto reader = mcap::Reader::open(path);
    return !reader || reader->finish().has_value();
  });
}

}  // namespace perdure::tools
