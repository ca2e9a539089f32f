// The messages of ROS recordings in the order of arrival: MCAP and SQLite (`.db3`) of ROS 2, and
// bags of ROS 1. Each is a file or a folder of files.
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
  std::uint64_t log_ns = 0;  ///< time of recording; never decreases
  std::uint64_t place = 0;   ///< increases in the order in which messages were written
  std::span<const std::uint8_t> data;
  std::shared_ptr<const void> keeper;  ///< owner of the memory of `data`
};

struct RosTopic {
  /// "sensor_msgs/Image", for both ROS versions; "sensor_msgs/Image in json" if it cannot be read
  std::string type;
  ros::Encoding encoding = ros::Encoding::kCdr;
  std::uint64_t messages = 0;
};
using RosTopics = std::map<std::string, RosTopic>;

/// A recording of any format.
class RosSource {
 public:
  virtual ~RosSource() = default;
  const RosTopics& topics() const { return topics_; }
  /// Counts of damaged or truncated data so far.
  const ReasonCounts& reasons() const { return reasons_; }
  const std::string& lastProblem() const { return last_problem_; }
  /// Restarts with the topics in `wanted` only, without data that end before `from_ns`.
  virtual void rewind(const std::set<std::string>& wanted, std::uint64_t from_ns) = 0;
  virtual std::optional<RosMessage> next() = 0;
  /// Notes for users about unpacked files and about files that were joined.
  virtual std::vector<std::string> notes() const { return {}; }
  /// Recording time of the first message. endNs() returns that of the last one.
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

/// openBag() opens a bag of ROS 1, openDb3() a SQLite file of ROS 2. Both throw StartupError with
/// the fix.
std::unique_ptr<RosSource> openBag(const std::filesystem::path& file);
std::unique_ptr<RosSource> openDb3(const std::filesystem::path& file);

/// The merged messages of all files of a recording.
class RosMessages : public RosSource {
 public:
  /// Returns whether the path is a file of these formats, or a folder with such files. Recordings
  /// of Perdure are excluded.
  static bool looksLikeOne(const std::filesystem::path& path);
  /// Throws StartupError with the fix.
  explicit RosMessages(const std::filesystem::path& path);

  std::vector<std::string> notes() const override;
  /// The sum of the counts of all files.
  ReasonCounts reasons() const;
  std::string lastProblem() const;
  void rewind(const std::set<std::string>& wanted, std::uint64_t from_ns = 0) override;
  std::optional<RosMessage> next() override;

  /// Decodes a message as M. Reason: "malformed" if its bytes end too early.
  template <class M>
  Result<M> valueOf(const RosMessage& message) const {
    return ros::messageOf<M>(message.data, topics_.at(message.topic).encoding, message.keeper);
  }

 private:
  /// The earliest of the sources' next messages, as recorded.
  std::optional<RosMessage> nextRecorded();
  /// Decompresses messages of rosbag2's `compression_mode: MESSAGE`. Returns false if a message is
  /// damaged, which is counted.
  bool unpack(RosMessage& message);
  UnpackedFiles unpacked_;  ///< for SQLite files; must be destroyed after the sources
  std::vector<std::string> notes_;
  std::vector<std::unique_ptr<RosSource>> sources_;
  std::vector<std::optional<RosMessage>> heads_;  ///< the next message of each source
};

}  // namespace perdure::replay
