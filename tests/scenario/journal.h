// Records the published data of each object in each frame, as far as the bars need them.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/types/objects.h"

namespace perdure::test {

/// One object in one frame.
struct Glance {
  ObjectId id = 0;
  double existence = 0.0, moving = 0.0;
  std::vector<std::pair<std::string, double>> pmf;   ///< most probable class first
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< in the truth's W, metres
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  double yaw = 0.0;
  bool confirmed = false, in_sight = false;
  Visibility visibility = Visibility::kVisible;
  ObjectId blocked_by = 0;
  std::uint32_t hits = 0, visible_misses = 0;
  TimePoint first_seen;
  std::uint64_t bits = 0;  ///< digest of all bits of existence, PMF, means and covariances

  const std::string& className() const { return pmf.front().first; }
  /// P(class, exists).
  double probability(const std::string& class_name) const;
};

struct JournalFrame {
  std::uint64_t frame = 0;
  TimePoint time;
  RigidTransform T_WB;  ///< the estimated pose
  std::vector<Glance> objects;

  const Glance* find(ObjectId id) const;
};

struct Journal {
  std::vector<JournalFrame> frames;
  Objects last;  ///< the newest message, complete

  void add(const Objects& objects);
  /// Returns the frame with this index in the dataset; nullptr if it was not published.
  const JournalFrame* at(std::uint64_t frame) const;
  /// Returns the frames in which the object was published, in order.
  std::vector<std::pair<const JournalFrame*, const Glance*>> of(ObjectId id) const;
};

}  // namespace perdure::test
