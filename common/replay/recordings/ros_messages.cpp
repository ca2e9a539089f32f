#include "common/replay/recordings/ros_messages.h"

#include <algorithm>

#include "common/base/algorithms/folder.h"
#include "common/replay/recordings/recorded_messages.h"
#include "common/replay/recordings/recording_parts.h"
#include "common/replay/recordings/unpack.h"
#include "common/ros/definition.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

bool isRosEncoding(const std::string& schema_encoding) {
  return schema_encoding == "ros2msg" || schema_encoding == "ros2idl" ||
         schema_encoding == "ros1msg";
}

/// An MCAP file of ROS 1 or ROS 2. The schema identifies the version, because converters write
/// arbitrary profiles.
class McapSource : public RosSource {
 public:
  explicit McapSource(const fs::path& path) : messages_(path) {
    for (const auto& [name, topic] : messages_.topics()) {
      if (!isRosEncoding(topic.schema_encoding)) continue;
      const bool old = topic.encoding == "ros1";
      topics_[name] = {ros::plainName(topic.type), old ? ros::Encoding::kRos1 : ros::Encoding::kCdr,
                       topic.messages};
    }
    start_ns_ = messages_.startNs();
    end_ns_ = messages_.endNs();
    reasons_ = messages_.reasons();
    last_problem_ = messages_.lastProblem();
  }

  void rewind(const std::set<std::string>& wanted, std::uint64_t from_ns) override {
    messages_.rewind([wanted](const std::string& topic) { return wanted.contains(topic); },
                     from_ns);
  }

  std::optional<RosMessage> next() override {
    auto message = messages_.next();
    reasons_ = messages_.reasons();
    last_problem_ = messages_.lastProblem();
    if (!message) return std::nullopt;
    return RosMessage{std::move(message->topic), message->log_ns, message->place, message->data,
                      message->keeper};
  }
  std::vector<std::string> notes() const override { return messages_.notes(); }

 private:
  RecordedMessages messages_;
};

std::vector<fs::path> filesWith(const fs::path& path, const char* extension) {
  const auto has = [&](const fs::path& file) { return file.extension() == extension; };
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return pathsIn(path, has);
  return has(path) ? std::vector{path} : std::vector<fs::path>();
}

bool holdsRos(const fs::path& path) {
  const RecordedMessages messages(path);
  return std::any_of(messages.topics().begin(), messages.topics().end(),
                     [](const auto& topic) { return isRosEncoding(topic.second.schema_encoding); });
}

}  // namespace

bool RosMessages::looksLikeOne(const fs::path& path) {
  if (!filesWith(path, ".bag").empty() || !filesWith(path, ".db3").empty()) return true;
  if (!packedFiles(path, ".db3").empty()) return true;
  return RecordedMessages::looksLikeOne(path) && holdsRos(path);
}

RosMessages::RosMessages(const fs::path& path) : unpacked_(unpackedFiles(path, ".db3")) {
  std::vector<RecordingPart> parts;
  const auto add = [&](std::unique_ptr<RosSource> source, const fs::path& file) {
    RecordingPart part{file, source->startNs(), source->endNs(), {}};
    for (const auto& [name, topic] : source->topics()) {
      if (topic.messages > 0) part.topics.insert(name);
    }
    parts.push_back(std::move(part));
    sources_.push_back(std::move(source));
  };
  for (const auto& file : filesWith(path, ".bag")) add(openBag(file), file);
  for (const auto& file : filesWith(path, ".db3")) add(openDb3(file), file);
  for (const auto& file : unpacked_) add(openDb3(file->path()), file->packed());
  std::stable_sort(sources_.begin(), sources_.end(),
                   [](const auto& a, const auto& b) { return a->startNs() < b->startNs(); });
  notes_ = joinParts(std::move(parts));
  const auto others = filesWith(path, ".mcap");
  if (sources_.empty()) {
    sources_.push_back(std::make_unique<McapSource>(path));
  } else if (!others.empty()) {
    notes_.push_back(others.front().string() +
                     " is left out, because the folder holds .bag or .db3 files; give it alone to "
                     "read it");
  }
  for (const auto& source : sources_) {
    start_ns_ = std::min(start_ns_, source->startNs());
    end_ns_ = std::max(end_ns_, source->endNs());
    for (const auto& [name, topic] : source->topics()) {
      RosTopic& all = topics_[name];
      const std::uint64_t before = all.messages;
      all = topic;
      all.messages += before;
    }
  }
}

std::vector<std::string> RosMessages::notes() const {
  std::vector<std::string> notes = notes_;
  for (const auto& file : unpacked_) notes.push_back(file->note());
  for (const auto& source : sources_) {
    for (auto& note : source->notes()) notes.push_back(std::move(note));
  }
  return notes;
}

ReasonCounts RosMessages::reasons() const {
  ReasonCounts all = reasons_;
  for (const auto& source : sources_) all.add(source->reasons());
  return all;
}

std::string RosMessages::lastProblem() const {
  std::string last = last_problem_;
  for (const auto& source : sources_) {
    if (!source->lastProblem().empty()) last = source->lastProblem();
  }
  return last;
}

void RosMessages::rewind(const std::set<std::string>& wanted, std::uint64_t from_ns) {
  heads_.clear();
  std::set<std::string> known;
  for (const std::string& topic : wanted) {
    if (topics_.contains(topic)) known.insert(topic);
  }
  for (const auto& source : sources_) {
    source->rewind(known, from_ns);
    heads_.push_back(source->next());
  }
}

std::optional<RosMessage> RosMessages::next() {
  auto message = nextRecorded();
  while (message && !unpack(*message)) message = nextRecorded();
  return message;
}

/// Unpacks a message if it is a zstd frame. It is recognised by its first bytes, which CDR never
/// has.
bool RosMessages::unpack(RosMessage& message) {
  static constexpr std::uint64_t kLargest = 1u << 30;
  if (topics_.at(message.topic).encoding != ros::Encoding::kCdr || !isZstd(message.data)) {
    return true;
  }
  auto whole = wholeOfZstd(message.data, kLargest);
  if (!whole) {
    count({"message_packing_damaged",
           message.topic + " has a message that is packed by zstd and cannot be unpacked"});
    return false;
  }
  const auto bytes = std::make_shared<const std::vector<std::uint8_t>>(*std::move(whole));
  message.data = *bytes;
  message.keeper = bytes;
  return true;
}

std::optional<RosMessage> RosMessages::nextRecorded() {
  std::size_t first = heads_.size();
  for (std::size_t i = 0; i < heads_.size(); ++i) {
    if (heads_[i] && (first == heads_.size() || heads_[i]->log_ns < heads_[first]->log_ns))
      first = i;
  }
  if (first == heads_.size()) return std::nullopt;
  auto message = std::move(heads_[first]);
  constexpr int kPlaceBits = 48;  // bits for the place within a file
  message->place |= std::uint64_t{first} << kPlaceBits;
  heads_[first] = sources_[first]->next();
  return message;
}

}  // namespace perdure::replay
