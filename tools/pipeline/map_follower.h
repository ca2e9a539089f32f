// Where a run lies in M: followed while it goes, and told in the end.
#pragma once

#include <optional>
#include <vector>

#include "common/mapping/mapper.h"
#include "tools/outputs/frames/drive_in_map.h"

namespace perdure::tools {

class MapFollower {
 public:
  explicit MapFollower(const WorldId& session) : session_(session) {}

  /// A frame of the session, when the map has heard of it.
  void follow(const Odometry& odometry, const mapping::Mapper& mapper);

  /// `last`: the last belief of each object, in the session's W.
  DriveInMap finish(const mapping::Mapper& mapper, const std::vector<ObjectBelief>& last) const;

 private:
  WorldId session_;
  std::optional<mapping::Anchor> first_;  ///< of the session
  std::map<std::uint64_t, Eigen::Vector3d> then_;
};

}  // namespace perdure::tools
