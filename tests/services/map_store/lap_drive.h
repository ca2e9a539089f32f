// A drive around a block with a map store that keeps a graph, for the tests of what the graph does.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <vector>

#include "common/math/so3.h"
#include "services/map_store/node.h"
#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store::test {

inline constexpr double kSide_m = 60.0, kLap_m = 4.0 * kSide_m, kReach_m = 25.0;
inline constexpr double kDrift = 2e-4;  ///< of yaw, rad/m
inline const WorldId kHere{77, 1};

inline RigidTransform planar(double x, double y, double yaw) {
  return {rotationAboutZ(yaw), Eigen::Vector3d(x, y, 0.0)};
}

/// Where the body is after `way_m` of laps around a block, anticlockwise.
inline RigidTransform onLap(double way_m) {
  const double s = std::fmod(way_m, kLap_m);
  const int side = static_cast<int>(s / kSide_m);
  RigidTransform corner;
  for (int i = 0; i < side; ++i) corner = corner * planar(kSide_m, 0.0, 0.5 * std::numbers::pi);
  return corner * planar(s - side * kSide_m, 0.0, 0.0);
}

struct Thing {
  Eigen::Vector3d p;
  const char* name;
};

/// At gaps that no other place has.
inline std::vector<Thing> things() {
  const char* names[] = {"car", "person", "car", "van", "car", "car", "person"};
  std::vector<Thing> result;
  double s = 2.0;
  for (std::size_t i = 0; s < kLap_m; s += 4.0 + 0.9 * static_cast<double>((5 * i * i) % 7), ++i) {
    const double side = i % 3 == 1 ? -1.0 : 1.0;
    result.push_back(
        {onLap(s) * Eigen::Vector3d(0.0, side * (4.0 + 0.5 * static_cast<double>(i % 5)), 0.8),
         names[(i * i + i / 3) % 7]});
  }
  return result;
}

/// A drive around the block with a map store that keeps a graph, and a filter that gives all that
/// it sees anew a new id until it is told better.
class LapDrive : public ::testing::Test {
 protected:
  LapDrive() {
    config_.store_path = folder_.file("map.sqlite");
    config_.graph = true;
    config_.mapping.anchor.walk_yaw = 0.003;
  }

  void start() {
    node_ = std::make_unique<Node>(
        config_, 5,
        Outputs{[this](const MapTile& t) {
                  tiles_[{t.x, t.y, t.part}] = t;
                },
                [this](const MapTile& t) {
                  tiles_.erase({t.x, t.y, t.part});
                },
                [](const MapHeader&) {}, [this](const MapReply& r) { replies_.push_back(r); },
                [this](const Recalled& r) { recalled_.push_back(r); },
                [this](const MapFrame& f) { frames_.push_back(f); },
                [this](const Event& e) { events_.push_back(e); }});
  }

  /// The body is lost, and begins elsewhere in a W of its own; nothing is in the working set.
  void beginAnew(const WorldId& world, double way_m, const RigidTransform& T_WB) {
    world_ = world;
    way_m_ = way_m;
    T_WB_ = T_WB;
    in_sight_.clear();
    working_.clear();
    recalled_.clear();
  }

  void driveTo(double way_m) {
    while (way_m_ < way_m) step();
  }
  /// Returns what was sent when the first loop was closed.
  Recalled driveToTheLoop() {
    while (recalled_.empty() && way_m_ < 1.5 * kLap_m) step();
    return recalled_.empty() ? Recalled{} : recalled_.front();
  }

  void step() {
    way_m_ += 1.0;
    T_WB_ = T_WB_ * (onLap(way_m_ - 1.0).inverse() * onLap(way_m_)) * planar(0.0, 0.0, drift_);
    Odometry odometry;
    odometry.stamp = stamp(++sequence_);
    odometry.world = world_;
    odometry.state = OdometryState::kTracking;
    odometry.T_WB = T_WB_;
    node_->onOdometry(odometry);
    const RigidTransform T_BM = onLap(way_m_).inverse();
    for (std::size_t i = 0; i < things_.size(); ++i) {
      const Eigen::Vector3d p_B = T_BM * things_[i].p;
      if (p_B.x() > 2.0 && p_B.norm() < kReach_m) {
        if (!in_sight_.contains(i)) in_sight_[i] = next_id_++;
        const ObjectId id = in_sight_.at(i);
        thing_of_[id] = i;
        working_[id] = seen(id, T_WB_ * p_B, things_[i].name);
      } else if (p_B.norm() > kReach_m + 15.0 && in_sight_.contains(i)) {
        working_.erase(in_sight_.at(i));
        in_sight_.erase(i);
      }
    }
    publish();
  }

  ObjectBelief seen(ObjectId id, const Eigen::Vector3d& p_W, const char* name) const {
    ObjectBelief belief = carAt(id, p_W, name);
    belief.last_seen = belief.as_of = stamp(sequence_).time;
    for (ClassBelief& c : belief.classes) {
      c.mean[3] = 0.3 + yawOf(T_WB_.R()) - yawOf(onLap(way_m_).R());
      c.covariance = 0.03 * Matrix7d::Identity();
      c.cross_pose.setZero();
    }
    return belief;
  }

  void publish() {
    std::vector<ObjectBelief> beliefs;
    for (const auto& [id, belief] : working_) beliefs.push_back(belief);
    Objects objects = workingSet(sequence_, std::move(beliefs));
    objects.stamp = stamp(sequence_);
    objects.world = world_;
    objects.T_WB = T_WB_;
    objects.next_id = next_id_;
    node_->onObjects(objects);
    node_->tick(objects.stamp.time.time_since_epoch());
  }

  static FrameStamp stamp(std::uint64_t sequence) {
    return {42, sequence, fromNanoseconds(100'000'000 * static_cast<std::int64_t>(sequence)), 0};
  }

  /// As a filter takes it up: not seen yet.
  void takeUp(const ObjectBelief& belief) {
    working_[belief.id] = belief;
    working_[belief.id].recalled = true;
  }

  ObjectBelief stored(ObjectId id) {
    node_->flush();
    MapQuery query;
    query.client = 3;
    query.request = ++request_;
    query.kind = MapQueryKind::kById;
    query.object_id = id;
    query.world = world_;  // as stored, each in its own W
    query.limit = 1;
    node_->onQuery(query);
    EXPECT_EQ(replies_.back().beliefs.size(), 1u) << id;
    return replies_.back().beliefs.empty() ? ObjectBelief{} : replies_.back().beliefs.front();
  }

  MapReply answerTo(MapQuery query) {
    query.client = 3;
    query.request = ++request_;
    query.limit = 1000;
    node_->onQuery(query);
    return replies_.back();
  }
  Eigen::Vector3d truthOf(ObjectId id) const { return things_[thing_of_.at(id)].p; }
  static Eigen::Vector3d placeOf(const MapObject& object) { return object.mean.head<3>(); }

  void ask(const Eigen::Vector3d& centre, double radius_m) {
    recalled_.clear();
    MapQuery query;
    query.client = 11;
    query.request = ++request_;
    query.kind = MapQueryKind::kRecall;
    query.low = centre;
    query.radius = radius_m;
    query.world = world_;
    query.limit = 100;
    node_->onQuery(query);
  }
  static bool has(const Recalled& recalled, ObjectId id) {
    return std::any_of(recalled.objects.begin(), recalled.objects.end(),
                       [&](const ObjectBelief& o) { return o.id == id; });
  }

  /// One of what was laid that the body does not see now.
  const ObjectBelief* unseenOf(const Recalled& laid) const {
    for (const ObjectBelief& belief : laid.objects) {
      if (!in_sight_.contains(thing_of_.at(belief.id))) return &belief;
    }
    return nullptr;
  }

  TemporaryFolder folder_;
  Config config_;
  std::unique_ptr<Node> node_;
  std::map<std::array<std::int32_t, 3>, MapTile> tiles_;  ///< as a late joiner sees them
  std::vector<MapReply> replies_;
  std::vector<Recalled> recalled_;
  std::vector<Thing> things_ = things();
  std::map<std::size_t, ObjectId> in_sight_;
  std::map<ObjectId, std::size_t> thing_of_;
  std::map<ObjectId, ObjectBelief> working_;
  std::vector<MapFrame> frames_;
  std::vector<Event> events_;
  WorldId world_ = kHere;
  RigidTransform T_WB_;
  double way_m_ = 0.0, drift_ = kDrift;
  std::uint64_t sequence_ = 0, request_ = 0;
  ObjectId next_id_ = 1;
};

}  // namespace perdure::map_store::test
