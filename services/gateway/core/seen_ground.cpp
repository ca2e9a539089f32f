#include "services/gateway/core/seen_ground.h"

#include <cmath>

#include "services/gateway/core/json_writer.h"
#include "services/gateway/core/pieces.h"

namespace perdure::gateway {
namespace {

constexpr double kCell_m = 4.0, kReach_m = 40.0;
constexpr double kShown_m = 150.0;      // distance from the body up to which cells are sent
constexpr std::size_t kMost = 200'000;  // cells; the record begins again if it has more

}  // namespace

void SeenGround::add(const CameraModel& camera, const RigidTransform& T_WB, double ground_m,
                     TimePoint time, const WorldId& world) {
  if (world != world_ || seen_.size() > kMost) clear();
  world_ = world;
  ground_m_ = ground_m;
  forGroundInView(camera, T_WB, {kCell_m, kReach_m, ground_m}, [&](int i, int j) {
    seen_[{i, j}] = time;
  });
}

void SeenGround::addAnchors(const CameraModel& camera, const MapReply& graph,
                            const RigidTransform& T_MW, double ground_m) {
  if (!looksAlongGround(camera)) return;
  const RigidTransform T_WM = T_MW.inverse();
  for (const MapAnchor& anchor : graph.anchors) {
    const Eigen::Quaterniond q(Eigen::AngleAxisd(anchor.yaw, Eigen::Vector3d::UnitZ()));
    forGroundInView(camera, T_WM * RigidTransform(q, anchor.p), {kCell_m, kReach_m, ground_m},
                    [&](int i, int j) {
                      before_[{i, j}] = {};
                    });
  }
}

void SeenGround::clear() { *this = {}; }

std::string SeenGround::json(const Eigen::Vector3d& p_WB, TimePoint now) const {
  JsonWriter json;
  json.begin('{').with("timestamp", now).with("frame_id", "odom").with("cell_m", kCell_m);
  json.with("ground_m", ground_m_).key("cells").begin('[');
  const auto put = [&](const std::pair<int, int>& cell, double age_s) {
    const Eigen::Vector2d centre((cell.first + 0.5) * kCell_m, (cell.second + 0.5) * kCell_m);
    if ((centre - p_WB.head<2>()).norm() > kShown_m) return;
    json.begin('[').number(centre.x(), 1).number(centre.y(), 1).number(age_s, 0).end(']');
  };
  for (const auto& [cell, time] : seen_) put(cell, std::max(0.0, toSeconds(now - time)));
  for (const auto& [cell, unknown] : before_) {
    if (!seen_.contains(cell)) put(cell, -1.0);
  }
  return json.end(']').end('}').take();
}

}  // namespace perdure::gateway
