#include "common/mapping/fusion/overlaps.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "common/mapping/frames/level_errors.h"
#include "common/mapping/fusion/relations.h"
#include "common/mapping/places/map_index.h"

namespace perdure::mapping {
namespace {

/// Largest distance between the centres of overlapping objects.
constexpr double kReach_m = 6.0;

struct Solid {
  ObjectId id = 0;
  const Sighting* seen = nullptr;
  std::string class_name;
  LevelPose T_MO;
  Eigen::Vector3d half = Eigen::Vector3d::Zero();  ///< half of length, width, height

  bool contains(const Eigen::Vector3d& p_M) const {
    const Eigen::Vector3d p = T_MO.inverse() * p_M;
    return (p.array().abs() < half.array()).all();
  }
};

std::vector<Eigen::Vector2d> centresOf(const std::vector<Solid>& solids) {
  std::vector<Eigen::Vector2d> centres;
  for (const Solid& solid : solids) centres.emplace_back(solid.T_MO.p.head<2>());
  return centres;
}

class Overlaps {
 public:
  Overlaps(const MapContents& map, const SavedMap& aligned, const PoseGraph& graph)
      : map_(map), graph_(graph), relations_(graph) {
    for (const auto& [id, record] : aligned.records) add(id, record);
  }

  std::vector<MergeOrder> run() {
    const PlaceGrid grid(kReach_m, centresOf(solids_));
    for (std::size_t a = 0; a < solids_.size(); ++a) {
      grid.around(solids_[a].T_MO.p.head<2>(), [&](std::size_t b) {
        if (a < b && mayBeOne(solids_[a], solids_[b])) link(a, b);
      });
    }
    return orders();
  }

 private:
  void add(ObjectId id, const ObjectRecord& record) {
    const auto object = map_.objects.find(id);
    if (object == map_.objects.end() || object->second.ended) return;
    const ClassBelief& best = object->second.belief.best();
    const PlacedObject& there = record.sighting.in_anchor;
    Solid solid{id, &record.sighting, best.name, {}, {}};
    solid.T_MO = graph_.pose(record.sighting.anchor) * LevelPose{there.p, there.yaw};
    solid.half = 0.5 * best.mean.tail<3>().array().exp().matrix();
    solids_.push_back(std::move(solid));
  }

  bool mayBeOne(const Solid& a, const Solid& b) {
    if (a.class_name != b.class_name) return false;
    return a.contains(b.T_MO.p) && b.contains(a.T_MO.p) && isKnown(a, b);
  }

  /// Returns true if the relative position is known better than the width of the narrower object.
  bool isKnown(const Solid& a, const Solid& b) {
    const auto T_ab = relations_.between(a.seen->anchor, b.seen->anchor);
    if (!T_ab) return false;
    const PlacedObject there = laid(*T_ab, b.seen->in_anchor);
    const Eigen::Matrix4d both = a.seen->in_anchor.covariance + there.covariance;
    return planeSigma(both) < 2.0 * std::min(a.half.y(), b.half.y());
  }

  void link(std::size_t a, std::size_t b) {
    partners_[a].push_back(b);
    partners_[b].push_back(a);
  }

  std::vector<MergeOrder> orders() const {
    std::vector<MergeOrder> orders;
    for (const auto& [a, of_a] : partners_) {
      const std::size_t b = of_a.front();
      if (a > b || of_a.size() > 1 || partners_.at(b).size() > 1) continue;
      orders.push_back({0, solids_[a].id, solids_[b].id});
    }
    return orders;
  }

  const MapContents& map_;
  const PoseGraph& graph_;
  Relations relations_;
  std::vector<Solid> solids_;
  std::map<std::size_t, std::vector<std::size_t>> partners_;
};

}  // namespace

std::vector<MergeOrder> overlapping(const MapContents& map, const SavedMap& aligned,
                                    const PoseGraph& graph) {
  return Overlaps(map, aligned, graph).run();
}

}  // namespace perdure::mapping
