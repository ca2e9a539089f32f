// Detection2DArray of ROS as detections: to which frame it belongs, and scores as evidence.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/ros/messages.h"
#include "common/types/detections.h"

namespace perdure::ros2 {

/// The frames that went by, by the stamp under which ROS knows them.
class FrameBook {
 public:
  void add(TimePoint ros_stamp, const FrameStamp& stamp);
  /// Within a millisecond, for detectors that keep stamps as seconds; nullptr where there is none.
  const FrameStamp* find(TimePoint ros_stamp) const;
  bool isAfterAll(TimePoint ros_stamp) const;

 private:
  struct Entry {
    TimePoint ros_stamp;
    FrameStamp stamp;
  };
  std::deque<Entry> frames_;
};

/// Of one box: log-probabilities of clutter and of each of `classes` classes, with the same scores
/// behind a soft-max where they sum to at most 1. `named`: class and score, 0 < score ≤ 1. Of what
/// scores leave, `other_share` is for classes that are not named, and the rest for clutter.
std::vector<float> activationsOf(const std::vector<std::pair<std::size_t, double>>& named,
                                 std::size_t classes, double other_share);

struct BoxesRead {
  std::vector<Detection> detections;
  std::vector<Reason> refused;  ///< box_malformed, score_malformed, class_unknown
};
/// `classes`: lower-case. A class_id is one of them, or its number.
BoxesRead boxesOf(const ros::Detection2DArray& message, const std::vector<std::string>& classes,
                  double other_share);

}  // namespace perdure::ros2
