// The messages of ROS' recordings, in the order in which they came: MCAP and SQLite (`.db3`) of
// ROS 2, bags of ROS 1, each a file or a folder of them.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/replay/recordings/unpacked_file.h"
#include "common/ros/bytes.h"

namespace perdure::replay {

struct RosMessage {
  std::string topic;         ///< "/cam0/image_raw"
  std::uint64_t log_ns = 0;  ///< when it was recorded; never goes back
  std::span<const std::uint8_t> data;
  std::shared_ptr<const void> keeper;  ///< of data
};

struct RosTopic {
  std::string type;  ///< "sensor_msgs/Image", of both ROS
  ros::Encoding encoding = ros::Encoding::kCdr;
  std::uint64_t messages = 0;
};
using RosTopics = std::map<std::string, RosTopic>;

/// One recording, whatever it is made of.
class RosSource {
 public:
  virtual ~RosSource() = default;
  const RosTopics& topics() const { return topics_; }
  /// What was damaged or cut so far.
  const ReasonCounts& reasons() const { return reasons_; }
  const std::string& lastProblem() const { return last_problem_; }
  /// Only these topics, and nothing that ended before.
  virtual void rewind(const std::set<std::string>& wanted, std::uint64_t from_ns) = 0;
  virtual std::optional<RosMessage> next() = 0;
  /// For people: what was unpacked.
  virtual std::vector<std::string> notes() const { return {}; }
  /// When the first and the last message were recorded.
  std::uint64_t startNs() const { return start_ns_; }
  std::uint64_t endNs() const { return end_ns_; }

 protected:
  void count(const Reason& reason) {
    reasons_.add(reason);
    last_problem_ = reason.detail;
  }
  RosTopics topics_;
  ReasonCounts reasons_;
  std::string last_problem_;
  std::uint64_t start_ns_ = UINT64_MAX, end_ns_ = 0;
};

/// Throw StartupError with the mend.
std::unique_ptr<RosSource> openBag(const std::filesystem::path& file);
std::unique_ptr<RosSource> openDb3(const std::filesystem::path& file);

class RosMessages {
 public:
  /// Whether it is such a file, or a folder with some. A recording of Perdure's own is none.
  static bool looksLikeOne(const std::filesystem::path& path);
  /// Throws StartupError with the mend.
  explicit RosMessages(const std::filesystem::path& path);

  const RosTopics& topics() const { return topics_; }
  std::uint64_t startNs() const { return start_ns_; }
  std::uint64_t endNs() const { return end_ns_; }
  /// For people: what was unpacked.
  std::vector<std::string> notes() const;
  ReasonCounts reasons() const;
  /// The last thing that was counted, for people.
  std::string lastProblem() const;
  void rewind(const std::set<std::string>& wanted, std::uint64_t from_ns = 0);
  std::optional<RosMessage> next();

  /// As the message M. Reason: "malformed".
  template <class M>
  Result<M> valueOf(const RosMessage& message) const {
    return ros::messageOf<M>(message.data, topics_.at(message.topic).encoding, message.keeper);
  }

 private:
  /// The next of all sources, as it was recorded.
  std::optional<RosMessage> nextRecorded();
  /// Of rosbag2's `compression_mode: MESSAGE`; false where it is damaged, which is counted.
  bool unpack(RosMessage& message);
  UnpackedFiles unpacked_;  ///< SQLite's; goes after the sources
  std::vector<std::unique_ptr<RosSource>> sources_;
  std::vector<std::optional<RosMessage>> heads_;  ///< the next message of each
  RosTopics topics_;
  std::uint64_t start_ns_ = UINT64_MAX, end_ns_ = 0;
  ReasonCounts reasons_;  ///< beside those of the sources
  std::string last_problem_;
};

}  // namespace perdure::replay
