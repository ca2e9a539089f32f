// Converts Detection2DArray of ROS to detections: finds their frame, and converts scores to
// activations.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/ros/messages.h"
#include "common/types/detections.h"

namespace perdure::ros2 {

class FrameBook {
 public:
  void add(TimePoint ros_stamp, const FrameStamp& stamp);
  /// Returns the frame within 1 ms of the stamp, or nullptr. Some detectors store stamps as
  /// floating-point seconds.
  const FrameStamp* find(TimePoint ros_stamp) const;
  bool isAfterAll(TimePoint ros_stamp) const;

 private:
  struct Entry {
    TimePoint ros_stamp;
    FrameStamp stamp;
  };
  std::deque<Entry> frames_;
};

/// Returns the activations of one box: clutter, then `classes` classes.
/// `named`: class and score, 0 < score ≤ 1. If the scores sum to less than 1, a soft-max of the
/// result gives the same scores; `other_share` of the remaining probability goes to classes without
/// a score, and the rest to clutter. Otherwise the scores are independent: the result has the
/// log-odds of each class, 0 for clutter, and `other_share` is not used.
std::vector<float> activationsOf(const std::vector<std::pair<std::size_t, double>>& named,
                                 std::size_t classes, double other_share);

struct BoxesRead {
  std::vector<Detection> detections;
  std::vector<Reason> refused;  ///< reasons box_malformed, score_malformed, class_unknown
};
/// Converts the boxes. `classes`: lower-case names. A class_id is one of these names, or its index.
BoxesRead boxesOf(const ros::Detection2DArray& message, const std::vector<std::string>& classes,
                  double other_share);

}  // namespace perdure::ros2
