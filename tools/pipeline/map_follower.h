// The pose of a run in M: tracked during the run and evaluated at the end.
#pragma once

#include <optional>
#include <vector>

#include "common/mapping/mapper.h"
#include "tools/outputs/frames/drive_in_map.h"

namespace perdure::tools {

class MapFollower {
 public:
  explicit MapFollower(const WorldId& session) : session_(session) {}

  /// Call it for each frame of the session after the mapper has received the frame.
  void follow(const Odometry& odometry, const mapping::Mapper& mapper);

  /// `last`: the last belief of each object, in the session's W.
  DriveInMap finish(const mapping::Mapper& mapper, const std::vector<ObjectBelief>& last) const;

 private:
  WorldId session_;
  std::optional<mapping::Anchor> first_;  ///< first anchor of the session
  std::map<std::uint64_t, Eigen::Vector3d> then_;
};

}  // namespace perdure::tools
