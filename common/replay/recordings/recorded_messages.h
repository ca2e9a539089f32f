// The messages of a recording, one file or a folder of segments, in the order in which they came.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <set>
#include <string>
#include <vector>

#include "common/replay/recordings/mcap_reader.h"
#include "common/replay/recordings/unpacked_file.h"
#include "common/wire/cdr.h"

namespace perdure::replay {

struct RecordedMessage {
  std::string topic;                   ///< "odometry": without perdure/<vehicle>/
  std::string type;                    ///< "perdure::msg::Odometry"
  std::uint64_t log_ns = 0;            ///< when the recorder got it; never goes back
  mcap::Bytes data;                    ///< common/wire/cdr.h
  std::shared_ptr<const void> keeper;  ///< of data
};

/// As a value of the topic's type. Reasons: "other_type" and those of decodeCdr.
template <class T>
Result<T> valueOf(const RecordedMessage& message) {
  if (message.type != wire::Type<T>::descriptor().m_typename) {
    return fail("other_type", message.topic + " was recorded as " + message.type);
  }
  return wire::decodeCdr<T>(message.data, message.keeper);
}

class RecordedMessages {
 public:
  struct TopicCount {
    std::string type;
    std::string schema_encoding = {}, encoding = {};  ///< "omgidl", "ros2msg"; "cdr", "ros1"
    std::uint64_t messages = 0;
  };

  /// Whether every chunk is unpacked at once, so that topics() is of what can be read.
  enum class Chunks { kByIndex, kEach };
  /// A .mcap file, or a folder that holds some; packed ones (.mcap.zstd) are unpacked. Throws
  /// StartupError with the mend.
  explicit RecordedMessages(const std::filesystem::path& path, Chunks look = Chunks::kByIndex);
  static bool looksLikeOne(const std::filesystem::path& path);

  const std::map<std::string, TopicCount>& topics() const { return topics_; }
  std::uint64_t startNs() const { return start_ns_; }
  std::uint64_t endNs() const { return end_ns_; }
  /// Files without a summary, and chunks that are damaged, so far.
  const ReasonCounts& reasons() const { return reasons_; }
  const std::string& lastProblem() const { return last_problem_; }
  /// For people: what was unpacked.
  std::vector<std::string> notes() const;

  /// Only of these topics (all where `wanted` is empty), and without chunks that end before.
  void rewind(std::function<bool(const std::string& topic)> wanted = {}, std::uint64_t from_ns = 0);
  /// The next one by log time; nothing at the end. What a recorder repeats at the beginning of each
  /// segment (calibration, model) is given once.
  std::optional<RecordedMessage> next();

 private:
  struct ChunkPlace {
    std::size_t file = 0;
    const mcap::ChunkIndex* index = nullptr;
  };
  struct Pending {
    RecordedMessage message;
    std::uint64_t order = 0;
    bool operator<(const Pending& other) const {  // the queue's top is the largest
      return std::tie(message.log_ns, order) > std::tie(other.message.log_ns, other.order);
    }
  };

  void openFile(const std::filesystem::path& path, Chunks look);
  std::string whyUnfinished(const mcap::Reader& reader) const;
  std::filesystem::path givenFor(const std::filesystem::path& file) const;
  void count(const Reason& reason);
  bool holdsWanted(const ChunkPlace& place) const;
  void load(const ChunkPlace& place);
  bool isRepeated(const RecordedMessage& message);

  UnpackedFiles unpacked_;  // goes after the files
  std::vector<mcap::Reader> files_;
  std::vector<ChunkPlace> chunks_;  // by time
  std::map<std::string, TopicCount> topics_;
  std::uint64_t start_ns_ = UINT64_MAX, end_ns_ = 0;
  ReasonCounts reasons_;
  std::string last_problem_;
  std::function<bool(const std::string&)> wanted_;
  std::uint64_t from_ns_ = 0;
  std::size_t next_chunk_ = 0;
  std::uint64_t order_ = 0;
  std::priority_queue<Pending> pending_;
  std::set<std::pair<std::string, std::uint64_t>> repeatable_;  // topic and digest
};

/// "perdure/ego/frame/cam0" → "frame/cam0"; others stay.
std::string topicOf(const std::string& channel);

}  // namespace perdure::replay
