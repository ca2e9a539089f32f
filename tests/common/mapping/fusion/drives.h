// Drives of vehicles along one street block, as the maps that they would store. Each vehicle has
// its own frame, drift and ids.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/mapping/fusion/map_contents.h"
#include "common/mapping/mapper.h"
#include "common/math/so3.h"

namespace perdure::mapping::test {

struct Thing {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double yaw = 0.0;
  std::string name;
};

inline constexpr double kSide_m = 150.0;

/// The body's pose after `way_m` along a square block, anticlockwise.
inline LevelPose onBlock(double way_m) {
  const double side = std::floor(way_m / kSide_m), along = way_m - side * kSide_m;
  LevelPose corner;
  for (int i = 0; i < static_cast<int>(side); ++i) {
    corner = corner * LevelPose{{kSide_m, 0.0, 0.0}, 0.5 * std::numbers::pi};
  }
  return corner * LevelPose{{along, 0.0, 0.0}, 0.0};
}

inline std::vector<Thing> thingsAlongBlock(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  std::vector<Thing> things;
  for (double s = 3.0; s < 4.0 * kSide_m; s += 5.0 + 7.0 * any(random)) {
    const bool car = any(random) < 0.6;
    const double side = any(random) < 0.5 ? -1.0 : 1.0;
    const LevelPose at = onBlock(s);
    Thing thing;
    thing.p = at * Eigen::Vector3d(0.0, side * (car ? 4.0 : 5.0 + 3.0 * any(random)), 0.8);
    thing.yaw = car ? at.yaw : std::numbers::pi * any(random);
    thing.name = car ? "car" : any(random) < 0.5 ? "person" : "van";
    things.push_back(thing);
  }
  return things;
}

struct DriveSettings {
  std::uint32_t seed = 1;
  double from_m = 0.0, to_m = 300.0;
  double yaw_walk = 0.0015;  ///< rad/√m; the declared value is the true one
  double clock_s = 0.0;      ///< time of its first frame
  WorldId world{1, 0};
  std::set<std::size_t> not_there = {};  ///< objects that left before the drive
};

/// A map, and the true object of each of its ids.
struct Driven {
  MapContents map;
  std::map<ObjectId, std::size_t> thing_of;
};

class Vehicle {
 public:
  Vehicle(const std::vector<Thing>& things, const DriveSettings& settings)
      : things_(things),
        settings_(settings),
        random_(settings.seed),
        mapper_(parametersOf(settings)),
        errors_(things.size()),
        ids_(things.size(), 0),
        hits_(things.size(), 0),
        way_m_(settings.from_m) {}

  static Parameters parametersOf(const DriveSettings& settings) {
    Parameters parameters;
    parameters.anchor.walk_yaw = settings.yaw_walk;
    return parameters;
  }

  /// The map that the store has when the body has travelled `way_m`. The drive can continue from
  /// it.
  Driven to(double way_m) {
    while (way_m_ < way_m) step();
    Driven driven;
    driven.map.graph = mapper_.unsaved().changed;
    for (const auto& [id, belief] : stored_) {
      if (belief.confirmed) driven.map.objects[id] = {settings_.world, belief, std::nullopt};
    }
    driven.thing_of = thing_of_;
    return driven;
  }

 private:
  static Eigen::Vector4d deviations() { return {0.15, 0.15, 0.08, 0.1}; }

  double normal(double deviation) {
    return deviation * std::normal_distribution<double>()(random_);
  }

  FrameStamp stamp() const {
    const double t = settings_.clock_s + 0.1 * static_cast<double>(sequence_);
    return {1, sequence_, TimePoint(durationFromSeconds(t)), 0};
  }

  void step() {
    const LevelPose before = onBlock(way_m_);
    way_m_ += 1.0;
    LevelPose increment = before.inverse() * onBlock(way_m_);
    increment.yaw += normal(settings_.yaw_walk);
    T_WB_ = T_WB_ * increment;
    ++sequence_;
    Odometry odometry;
    odometry.stamp = stamp();
    odometry.world = settings_.world;
    odometry.state = OdometryState::kTracking;
    odometry.T_WB = T_WB_.rigid();
    mapper_.onOdometry(odometry);
    mapper_.onObjects(workingSet());
    (void)mapper_.takeChange();
  }

  Objects workingSet() {
    Objects objects;
    objects.stamp = stamp();
    objects.world = settings_.world;
    objects.T_WB = T_WB_.rigid();
    const LevelPose T_BM = onBlock(way_m_).inverse();
    for (std::size_t i = 0; i < things_.size(); ++i) {
      const Eigen::Vector3d p_B = T_BM * things_[i].p;
      if (p_B.x() < 2.0 || p_B.norm() > 30.0 || settings_.not_there.contains(i)) continue;
      objects.objects.push_back(see(i, p_B));
    }
    objects.next_id = next_id_;
    return objects;
  }

  const ObjectBelief& see(std::size_t i, const Eigen::Vector3d& p_B) {
    if (ids_[i] == 0) {
      ids_[i] = next_id_++;
      thing_of_[ids_[i]] = i;
      for (double& e : errors_[i]) e = normal(1.0);
      errors_[i] = (errors_[i].array() * deviations().array()).matrix().eval();
      stored_[ids_[i]].first_seen = stamp().time;
    }
    ++hits_[i];
    ObjectBelief& belief = stored_.at(ids_[i]);
    belief.id = ids_[i];
    belief.existence = 0.95;
    belief.confirmed = hits_[i] >= 3;
    belief.hits = hits_[i];
    belief.last_seen = belief.as_of = stamp().time;
    ClassBelief c;
    c.name = things_[i].name;
    c.probability = 0.9;
    c.mean.head<3>() = T_WB_ * (p_B + errors_[i].head<3>());
    c.mean[3] = wrapAngle(things_[i].yaw - onBlock(way_m_).yaw + T_WB_.yaw + errors_[i][3]);
    c.covariance = 0.01 * Matrix7d::Identity();
    c.covariance.topLeftCorner<4, 4>() = deviations().array().square().matrix().asDiagonal();
    ClassBelief other = c;
    other.name = kOtherClass;
    other.probability = 0.1;
    belief.classes = {c, other};
    return belief;
  }

  const std::vector<Thing>& things_;
  DriveSettings settings_;
  std::mt19937 random_;
  Mapper mapper_;
  std::vector<Eigen::Vector4d> errors_;
  std::vector<ObjectId> ids_;
  std::vector<std::uint32_t> hits_;
  std::map<ObjectId, std::size_t> thing_of_;
  std::map<ObjectId, ObjectBelief> stored_;
  LevelPose T_WB_;
  double way_m_;
  std::uint64_t sequence_ = 0;
  ObjectId next_id_ = 1;
};

inline Driven driven(const std::vector<Thing>& things, const DriveSettings& settings) {
  return Vehicle(things, settings).to(settings.to_m);
}

inline MapContents mapOfAShortDrive() {
  static const auto things = thingsAlongBlock(1);
  static const auto drive = driven(things, {.to_m = 100.0});
  return drive.map;
}

}  // namespace perdure::mapping::test
