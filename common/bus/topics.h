// The topics of common/wire/topics.h for programs that find them by name.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/bus/security/roles.h"
#include "common/wire/topics.h"

namespace perdure::bus {

using wire::leaseFor;
using wire::Qos;

struct TopicInfo {
  std::string_view name;  ///< "frame/" stands for frame/<camera>
  const dds_topic_descriptor_t* type = nullptr;
  Qos qos;
  double rate_hz = 0.0;  ///< nominal, for a 10 Hz camera and a 100 Hz IMU; 0: on change
  bool recorded = true;
  /// The roles that may write or read the topic, including those with access to every topic.
  Roles writers = {}, readers = {};

  std::string typeName() const;
};

std::span<const TopicInfo> topicTable();
/// Returns the row of a topic such as "imu" or "frame/cam0", or nullptr for unknown topics.
const TopicInfo* findTopic(std::string_view name);

/// Returns the expected rate of a topic if camera and IMU have these rates; 0: on change.
double expectedRate(const TopicInfo& info, double camera_hz, double imu_hz);

/// A topic's name with the type of its messages.
template <class T>
struct Topic {
  std::string name;
};

/// The topic of a message type. For Frame it is only the prefix: see frameTopic().
template <class T>
inline const Topic<T> kTopic{std::string(wire::nameOfTopic<T>())};

/// vio's estimates of the cameras; they replace the calibration with the same source.
inline const Topic<Calibration> kEstimatedCalibration{"calibration/estimated"};

inline Topic<Frame> frameTopic(const std::string& camera) { return {kTopic<Frame>.name + camera}; }

/// Returns whether `row`, a name in the table, is the row of `topic`.
inline bool isRowOf(std::string_view row, std::string_view topic) {
  return row.ends_with('/') ? topic.starts_with(row) && topic != row : topic == row;
}

/// Calls visit(Topic<T>) for the topic `name`, with its type. Returns false if the name is unknown.
template <class Visit>
bool withTopic(const std::string& name, Visit visit) {
  bool found = false;
  wire::forEachTopic([&]<class Row>(const Row& row) {
    if (!isRowOf(row.name, name)) return;
    found = true;
    visit(Topic<typename Row::Message>{name});
  });
  return found;
}

}  // namespace perdure::bus
