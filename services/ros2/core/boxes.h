// Converts Detection2DArray of ROS to detections: their frame, and scores as evidence.
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
  /// Frame within 1 ms of the stamp (some detectors store seconds); nullptr if there is none.
  const FrameStamp* find(TimePoint ros_stamp) const;
  bool isAfterAll(TimePoint ros_stamp) const;

 private:
  struct Entry {
    TimePoint ros_stamp;
    FrameStamp stamp;
  };
  std::deque<Entry> frames_;
};

/// Activations of one box: log-probabilities of clutter and of `classes` classes. A soft-max gives
/// the same scores if they sum to at most 1. `named`: class and score, 0 < score ≤ 1. Of the
/// remaining probability, `other_share` goes to classes without a score, and the rest to clutter.
std::vector<float> activationsOf(const std::vector<std::pair<std::size_t, double>>& named,
                                 std::size_t classes, double other_share);

struct BoxesRead {
  std::vector<Detection> detections;
  std::vector<Reason> refused;  ///< reasons box_malformed, score_malformed, class_unknown
};
/// `classes`: lower-case. A class_id is one of them, or its index.
BoxesRead boxesOf(const ros::Detection2DArray& message, const std::vector<std::string>& classes,
                  double other_share);

}  // namespace perdure::ros2
