// The messages of a recording (a file or a folder of segments) in the order of arrival.
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
#include "common/replay/recordings/recording_parts.h"
#include "common/replay/recordings/unpacked_file.h"
#include "common/wire/cdr.h"

namespace perdure::replay {

struct RecordedMessage {
  std::string topic;                   ///< "odometry": without the prefix perdure/<vehicle>/
  std::string type;                    ///< "perdure::msg::Odometry"
  std::uint64_t log_ns = 0;            ///< time of arrival at the recorder; never decreases
  std::uint64_t place = 0;             ///< increases in the order of the file
  mcap::Bytes data;                    ///< format: common/wire/cdr.h
  std::shared_ptr<const void> keeper;  ///< owner of the memory of `data`
};

/// Decodes the message as a value of the topic's type. Reasons: "other_type" and those of
/// decodeCdr.
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

  /// kEach unpacks every chunk at once, so that topics() describes the readable part.
  enum class Chunks { kByIndex, kEach };
  /// Opens a .mcap file, or a folder that contains such files. Compressed files (.mcap.zstd) are
  /// unpacked. Throws StartupError with the fix.
  explicit RecordedMessages(const std::filesystem::path& path, Chunks look = Chunks::kByIndex);
  static bool looksLikeOne(const std::filesystem::path& path);

  const std::map<std::string, TopicCount>& topics() const { return topics_; }
  std::uint64_t startNs() const { return start_ns_; }
  std::uint64_t endNs() const { return end_ns_; }
  /// Counts of files without a summary and of damaged chunks found so far.
  const ReasonCounts& reasons() const { return reasons_; }
  const std::string& lastProblem() const { return last_problem_; }
  /// Notes for users about unpacked files and about files that were joined.
  std::vector<std::string> notes() const;

  /// Restarts with the topics for which `wanted` is true (all if it is empty), without chunks that
  /// end before `from_ns`.
  void rewind(std::function<bool(const std::string& topic)> wanted = {}, std::uint64_t from_ns = 0);
  /// The next message by log time. Returns nothing at the end. Messages repeated by the recorder at
  /// the start of each segment (calibration, model) are returned once.
  std::optional<RecordedMessage> next();

 private:
  struct ChunkPlace {
    std::size_t file = 0;
    const mcap::ChunkIndex* index = nullptr;
    std::uint64_t number = 0;  ///< number of the chunk in the order of the files
  };
  struct Pending {
    RecordedMessage message;
    std::uint64_t order = 0;
    /// The top of the queue is the largest element, here the earliest one.
    bool operator<(const Pending& other) const {
      return std::tie(message.log_ns, order) > std::tie(other.message.log_ns, other.order);
    }
  };

  void openFile(const std::filesystem::path& path, Chunks look, std::vector<RecordingPart>& parts);
  std::string whyUnfinished(const mcap::Reader& reader) const;
  std::filesystem::path givenFor(const std::filesystem::path& file) const;
  void count(const Reason& reason);
  bool holdsWanted(const ChunkPlace& place) const;
  void load(const ChunkPlace& place);
  bool isRepeated(const RecordedMessage& message);

  std::vector<std::string> notes_;
  UnpackedFiles unpacked_;  // must be destroyed after the files
  std::vector<mcap::Reader> files_;
  std::vector<ChunkPlace> chunks_;  // sorted by time
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

/// "perdure/ego/frame/cam0" → "frame/cam0"; other names are unchanged.
std::string topicOf(const std::string& channel);

}  // namespace perdure::replay
