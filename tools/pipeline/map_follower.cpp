#include "tools/pipeline/map_follower.h"

#include <algorithm>

#include "common/mapping/map_frames.h"
#include "common/math/so3.h"

namespace perdure::tools {
namespace {

using mapping::LevelPose;

/// Returns the T_MW that transforms a belief to `placed`, the object's pose in M by the graph. The
/// yaw of `placed` is known modulo 180°; `turn` is the approximate yaw of T_MW.
RigidTransform layingOf(const ObjectBelief& belief, const mapping::PlacedObject& placed,
                        double turn) {
  const Vector7d& mean = belief.best().mean;
  const double about = wrapAngle(placed.yaw - mean[3] - turn);
  const LevelPose T{Eigen::Vector3d::Zero(), turn + mapping::wrapHalfTurn(about)};
  const Eigen::Vector3d p_W = mean.head<3>();
  return LevelPose{placed.p - T * p_W, T.yaw}.rigid();
}

bool isDrawn(const mapping::MapFrames& frames, mapping::AnchorId anchor, const WorldId& map) {
  return frames.at(anchor, {}).map == map;
}

}  // namespace

void MapFollower::follow(const Odometry& odometry, const mapping::Mapper& mapper) {
  if (odometry.world != session_ || !mapper.follows(session_)) return;
  if (!first_) {
    for (const auto& [id, anchor] : mapper.anchors()) {
      if (anchor.session == session_ && !first_) first_ = anchor;
    }
  }
  const RigidTransform T_MW_begin =
      mapper.graph().pose(first_->id).rigid() * first_->T_WA.inverse();
  then_[odometry.stamp.sequence] = T_MW_begin.inverse() * (mapper.T_MW() * odometry.T_WB.p);
}

DriveInMap MapFollower::finish(const mapping::Mapper& mapper,
                               const std::vector<ObjectBelief>& last) const {
  DriveInMap drive;
  for (const auto& [time, T_MW] : mapper.along(session_)) drive.along.emplace_back(time, T_MW);
  if (drive.along.empty()) return drive;
  drive.then = then_;
  const mapping::MapFrames frames(mapper.graph(), mapper.anchors());
  const WorldId map = frames.mapOf(session_);
  for (const ObjectBelief& belief : last) {
    const mapping::ObjectRecord* record = mapper.recordOf(belief.id);
    const bool of_its_own = record != nullptr && record->session.world == session_.world;
    const WorldId world = of_its_own ? record->session : session_;  // possibly of a later epoch
    const RigidTransform T_MW =
        frames.at(frames.anchorOf(record, world, belief.last_seen), world).T_MW;
    drive.objects[belief.id] = T_MW;
    if (!belief.recalled || record == nullptr) continue;
    // The graph placed a recalled object, and it has not been detected since. So its position does
    // not depend on the session's W.
    const mapping::Sighting& sighting = record->sighting;
    if (!isDrawn(frames, sighting.anchor, map)) continue;
    const auto placed =
        mapping::transformed(mapper.graph().pose(sighting.anchor), sighting.in_anchor);
    drive.objects[belief.id] = layingOf(belief, placed, yawOf(T_MW.R()));
  }
  for (const auto& [id, anchor] : mapper.anchors()) {
    if (isDrawn(frames, id, map)) drive.anchors_M.push_back(mapper.graph().pose(id).p);
  }
  for (const auto& [id, edge] : mapper.graph().edges()) {
    if (edge.kind == mapping::EdgeKind::kOdometry || !isDrawn(frames, edge.a, map) ||
        !isDrawn(frames, edge.b, map)) {
      continue;
    }
    drive.loops.push_back({mapper.graph().pose(edge.a).p, mapper.graph().pose(edge.b).p,
                           mapper.graph().weight(id) >= mapping::kBelieved});
  }
  return drive;
}

}  // namespace perdure::tools
