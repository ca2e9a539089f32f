#include "common/replay/recordings/recorded_messages.h"

#include <algorithm>
#include <tuple>

#include "common/base/algorithms/folder.h"
#include "common/base/errors.h"
#include "common/base/ids.h"
#include "common/replay/recordings/recording_parts.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

constexpr char kExtension[] = ".mcap";

/// The recording files that are not compressed as a whole.
std::vector<fs::path> plainFilesIn(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    return pathsIn(path, [](const fs::path& file) { return file.extension() == kExtension; });
  }
  return isPacked(path, kExtension) ? std::vector<fs::path>() : std::vector{path};
}

/// Returns true for topics that a recorder repeats at the start of each segment.
bool isLatchedAlone(const std::string& topic) {
  return topic.starts_with("calibration") || topic == "model";
}

std::uint64_t startOf(const mcap::Reader& file) {
  std::uint64_t start = UINT64_MAX;
  for (const auto& chunk : file.chunks()) start = std::min(start, chunk.start_ns);
  return start;
}

}  // namespace

std::string topicOf(const std::string& channel) {
  constexpr std::string_view kPrefix = "perdure/";
  if (!channel.starts_with(kPrefix)) return channel;
  const auto slash = channel.find('/', kPrefix.size());
  return slash == std::string::npos ? channel : channel.substr(slash + 1);
}

bool RecordedMessages::looksLikeOne(const fs::path& path) {
  std::error_code ignored;
  if (path.extension() == kExtension || !packedFiles(path, kExtension).empty()) return true;
  return fs::is_directory(path, ignored) && !plainFilesIn(path).empty();
}

RecordedMessages::RecordedMessages(const fs::path& path, Chunks look)
    : unpacked_(unpackedFiles(path, kExtension)) {
  auto files = plainFilesIn(path);
  for (const auto& file : unpacked_) files.push_back(file->path());
  std::sort(files.begin(), files.end(),
            [](const auto& a, const auto& b) { return a.filename() < b.filename(); });
  std::vector<RecordingPart> parts;
  for (const fs::path& file : files) openFile(file, look, parts);
  notes_ = joinParts(std::move(parts));
  // Names do not give the order of the files, because "10" sorts before "2".
  std::stable_sort(files_.begin(), files_.end(),
                   [](const auto& a, const auto& b) { return startOf(a) < startOf(b); });
  for (std::size_t i = 0; i < files_.size(); ++i) {
    for (const auto& chunk : files_[i].chunks()) chunks_.push_back({i, &chunk, chunks_.size()});
  }
  if (chunks_.empty()) {
    throw StartupError(ExitCode::kUnavailable,
                       path.string() + " holds no messages" +
                           (last_problem_.empty() ? "" : " (" + last_problem_ + ")") +
                           "; perdure record makes recordings");
  }
  std::stable_sort(chunks_.begin(), chunks_.end(), [](const auto& a, const auto& b) {
    return a.index->start_ns < b.index->start_ns;
  });
  rewind();
}

void RecordedMessages::openFile(const fs::path& path, Chunks look,
                                std::vector<RecordingPart>& parts) {
  auto reader = mcap::Reader::open(path);
  if (!reader) {
    if (reader.error().code == "file") {
      throw StartupError(ExitCode::kUnavailable, reader.error().detail);
    }
    return count(reader.error());
  }
  if (reader->size() == 0) {
    return count({"unfinished", givenFor(path).string() + " is empty (0 bytes)"});
  }
  if (look == Chunks::kEach) reader->check();
  if (!reader->finished()) {
    count({reader->followed() ? "followed" : "unfinished", whyUnfinished(*reader)});
  }
  for (const mcap::Damage& one : reader->damage()) reasons_.add(one.reason);
  if (!reader->damage().empty()) last_problem_ = mcap::sentenceOfDamage(givenFor(path), *reader);
  RecordingPart part{givenFor(path), UINT64_MAX, 0, {}};
  const auto& catalogue = reader->catalogue();
  for (const auto& [id, n] : reader->statistics().by_channel) {
    const auto channel = catalogue.channels.find(id);
    if (channel == catalogue.channels.end() || n == 0) continue;
    TopicCount& topic = topics_[topicOf(channel->second.topic)];
    const auto schema = catalogue.schemas.find(channel->second.schema);
    topic.encoding = channel->second.encoding;
    if (schema != catalogue.schemas.end()) {
      topic.type = schema->second.name;
      topic.schema_encoding = schema->second.encoding;
    }
    topic.messages += n;
    part.topics.insert(channel->second.topic);
  }
  for (const auto& chunk : reader->chunks()) {
    part.start_ns = std::min(part.start_ns, chunk.start_ns);
    part.end_ns = std::max(part.end_ns, chunk.end_ns);
  }
  start_ns_ = std::min(start_ns_, part.start_ns);
  end_ns_ = std::max(end_ns_, part.end_ns);
  parts.push_back(std::move(part));
  reader->letGo();  // a folder may have more segments than a process may open at once
  files_.push_back(*std::move(reader));
}

/// Returns the compressed file if `file` is its temporary unpacked copy, otherwise `file`. Messages
/// for users name the compressed file.
fs::path RecordedMessages::givenFor(const fs::path& file) const {
  const auto same = [&](const auto& unpacked) { return unpacked->path() == file; };
  const auto packed = std::find_if(unpacked_.begin(), unpacked_.end(), same);
  return packed == unpacked_.end() ? file : (*packed)->packed();
}

std::string RecordedMessages::whyUnfinished(const mcap::Reader& reader) const {
  const fs::path given = givenFor(reader.path());
  if (reader.followed()) return mcap::sentenceOfFollowed(given);
  const std::string first =
      given == reader.path() ? "" : "unpack it first (zstd -d " + given.string() + "), then ";
  return given.string() + " was not finished: " + std::to_string(reader.cutBytes()) +
         " bytes at its end are lost; " + first + "`perdure record repair` makes it whole";
}

std::vector<std::string> RecordedMessages::notes() const {
  std::vector<std::string> notes = notes_;
  for (const auto& file : unpacked_) notes.push_back(file->note());
  return notes;
}

void RecordedMessages::count(const Reason& reason) {
  reasons_.add(reason);
  last_problem_ = reason.detail;
}

void RecordedMessages::rewind(std::function<bool(const std::string&)> wanted,
                              std::uint64_t from_ns) {
  wanted_ = std::move(wanted);
  from_ns_ = from_ns;
  next_chunk_ = 0;
  order_ = 0;
  pending_ = {};
  repeatable_.clear();
}

bool RecordedMessages::holdsWanted(const ChunkPlace& place) const {
  if (place.index->end_ns < from_ns_) return false;
  if (!wanted_ || place.index->index_offsets.empty()) return true;
  const auto& channels = files_[place.file].catalogue().channels;
  for (const auto& [id, offset] : place.index->index_offsets) {
    const auto channel = channels.find(id);
    if (channel == channels.end() || wanted_(topicOf(channel->second.topic))) return true;
  }
  return false;
}

void RecordedMessages::load(const ChunkPlace& place) {
  if (!holdsWanted(place)) return;
  const mcap::Reader& file = files_[place.file];
  const auto records = file.unpack(*place.index);
  if (!records) return count(records.error());
  mcap::Catalogue catalogue = file.catalogue();
  constexpr int kOffsetBits = 32;
  const auto visit = [&](const mcap::Message& message, std::uint64_t offset) {
    const auto channel = catalogue.channels.find(message.channel);
    if (channel == catalogue.channels.end()) {
      return count({"channel_unknown", file.path().string() + " has a message of no channel"});
    }
    RecordedMessage recorded;
    recorded.topic = topicOf(channel->second.topic);
    if (wanted_ && !wanted_(recorded.topic)) return;
    const auto schema = catalogue.schemas.find(channel->second.schema);
    if (schema != catalogue.schemas.end()) recorded.type = schema->second.name;
    recorded.log_ns = message.log_ns;
    recorded.place = (place.number << kOffsetBits) + offset;
    recorded.data = message.data;
    recorded.keeper = *records;
    pending_.push({std::move(recorded), order_++});
  };
  if (!mcap::forEachMessage(**records, visit, catalogue)) {
    count({"chunk_damaged", file.path().string() + ": a chunk ends within a record"});
  }
}

bool RecordedMessages::isRepeated(const RecordedMessage& message) {
  if (!isLatchedAlone(message.topic)) return false;
  const std::string_view bytes(reinterpret_cast<const char*>(message.data.data()),
                               message.data.size());
  return !repeatable_.emplace(message.topic, digest(bytes)).second;
}

std::optional<RecordedMessage> RecordedMessages::next() {
  while (true) {
    while (next_chunk_ < chunks_.size() &&
           (pending_.empty() ||
            chunks_[next_chunk_].index->start_ns <= pending_.top().message.log_ns)) {
      load(chunks_[next_chunk_++]);
    }
    if (pending_.empty()) return std::nullopt;
    RecordedMessage message = pending_.top().message;
    pending_.pop();
    if (!isRepeated(message)) return message;
  }
}

}  // namespace perdure::replay
