// Records the poses of a run in M during the run, and computes the final ones at its end.
#pragma once

#include <optional>
#include <vector>

#include "common/mapping/mapper.h"
#include "tools/outputs/frames/drive_in_map.h"

namespace perdure::tools {

class MapFollower {
 public:
  explicit MapFollower(const WorldId& session) : session_(session) {}

  /// Records the body's position. Must be called for each frame after the mapper has received it.
  void follow(const Odometry& odometry, const mapping::Mapper& mapper);

  /// Returns the poses by the final graph. `last`: each object's last belief, in the session's W.
  DriveInMap finish(const mapping::Mapper& mapper, const std::vector<ObjectBelief>& last) const;

 private:
  WorldId session_;
  std::optional<mapping::Anchor> first_;  ///< first anchor of the session
  std::map<std::uint64_t, Eigen::Vector3d> then_;
};

}  // namespace perdure::tools
