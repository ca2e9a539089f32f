// A drive around a block, and a map store that has a graph. For tests of the effects of the graph.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "common/math/so3.h"
#include "services/map_store/node.h"
#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store::test {

inline constexpr double kSide_m = 60.0, kLap_m = 4.0 * kSide_m, kReach_m = 25.0;
inline constexpr double kDrift = 2e-4;  ///< drift of the yaw, rad/m
inline const WorldId kHere{77, 1};

inline RigidTransform planar(double x, double y, double yaw) {
  return {rotationAboutZ(yaw), Eigen::Vector3d(x, y, 0.0)};
}

/// The body's pose after `way_m` of laps around a block, anticlockwise.
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

/// The body's pose after a distance travelled.
using Path = std::function<RigidTransform(double)>;

/// Objects along a path, at gaps that differ from place to place.
inline std::vector<Thing> things(const Path& path = onLap, double length_m = kLap_m) {
  const char* names[] = {"car", "person", "car", "van", "car", "car", "person"};
  std::vector<Thing> result;
  double s = 2.0;
  for (std::size_t i = 0; s < length_m;
       s += 4.0 + 0.9 * static_cast<double>((5 * i * i) % 7), ++i) {
    const double side = i % 3 == 1 ? -1.0 : 1.0;
    result.push_back(
        {path(s) * Eigen::Vector3d(0.0, side * (4.0 + 0.5 * static_cast<double>(i % 5)), 0.8),
         names[(i * i + i / 3) % 7]});
  }
  return result;
}

/// A drive around a block, with a map store that has a graph and with a simulated filter. The
/// filter initiates a track for each detected object without one, and follows map/near. Detections
/// are exact.
class LapDrive : public ::testing::Test {
 protected:
  LapDrive() {
    config_.store_path = folder_.file("map.sqlite");
    config_.graph = true;
    config_.mapping.anchor.walk_yaw = 0.003;
  }

  /// Each process has its own instance id.
  void start() {
    ++store_;
    node_ = std::make_unique<Node>(
        config_, store_,
        Outputs{[this](const MapTile& t) {
                  tiles_[{t.x, t.y, t.part}] = t;
                },
                [this](const MapTile& t) {
                  tiles_.erase({t.x, t.y, t.part});
                },
                [](const MapHeader&) {}, [this](const MapReply& r) { replies_.push_back(r); },
                [this](const MapNear& n) {
                  nears_.push_back(n);
                  coming_.push_back(n);
                },
                [this](const MapFrame& f) { frames_.push_back(f); },
                [this](const Event& e) { events_.push_back(e); }});
  }

  /// The body loses its position and continues elsewhere in its own W, with an empty working set.
  void beginAnew(const WorldId& world, double way_m, const RigidTransform& T_WB) {
    world_ = world;
    way_m_ = way_m;
    T_WB_ = T_WB;
    forgetTracks();
    nears_.clear();
  }

  void driveTo(double way_m) {
    while (way_m_ < way_m) step();
  }
  /// Returns the message that was sent when the first loop was closed. The filter has not used it
  /// yet.
  MapNear driveToTheLoop() {
    const std::size_t before = loops();
    while (loops() == before && way_m_ < 1.5 * kLap_m) step();
    EXPECT_GT(loops(), before);
    return nears_.empty() ? MapNear{} : nears_.back();
  }
  std::size_t count(EventKind kind) const {
    return static_cast<std::size_t>(std::count_if(events_.begin(), events_.end(),
                                                  [&](const Event& e) { return e.kind == kind; }));
  }
  std::size_t loops() const {
    return count(EventKind::kLoopClosed) + count(EventKind::kRelocalised);
  }

  void step() {
    hear();
    move();
    see();
    send(objects());
  }

  void move() {
    way_m_ += 1.0;
    T_WB_ = T_WB_ * (path_(way_m_ - 1.0).inverse() * path_(way_m_)) * planar(0.0, 0.0, drift_);
    Odometry odometry;
    odometry.stamp = stamp(++sequence_);
    odometry.world = world_;
    odometry.state = OdometryState::kTracking;
    odometry.T_WB = T_WB_;
    node_->onOdometry(odometry);
  }

  void see() {
    const RigidTransform T_BM = path_(way_m_).inverse();
    for (std::size_t i = 0; i < things_.size(); ++i) {
      const Eigen::Vector3d p_B = T_BM * things_[i].p;
      if (p_B.x() < 2.0 || p_B.norm() > kReach_m) continue;
      const auto [track, is_new] = in_sight_.try_emplace(i, next_id_);
      next_id_ += is_new ? 1 : 0;
      thing_of_[track->second] = i;
      working_[track->second] = seen(track->second, T_WB_ * p_B, things_[i].name);
    }
    letGo();
  }

  /// Removes distant tracks from the working set once the map has them on disk.
  void letGo() {
    constexpr double kMargin_m = 15.0;
    std::erase_if(working_, [&](const auto& each) {
      const ObjectBelief& belief = each.second;
      const double distance = (belief.best().mean.template head<3>() - T_WB_.p).norm();
      const bool leaves = distance > near_m_ + kMargin_m && belief.last_seen <= kept_;
      if (leaves) forgetSight(each.first);
      return leaves;
    });
  }
  void forgetSight(TrackId track) {
    std::erase_if(in_sight_, [track](const auto& each) { return each.second == track; });
  }

  ObjectBelief seen(TrackId id, const Eigen::Vector3d& p_W, const char* name) const {
    ObjectBelief belief = carAt(id, p_W, name);
    belief.last_seen = belief.as_of = stamp(sequence_).time;
    for (ClassBelief& c : belief.classes) {
      c.mean[3] = 0.3 + yawOf(T_WB_.R()) - yawOf(path_(way_m_).R());
      c.covariance = 0.03 * Matrix7d::Identity();
      c.cross_pose.setZero();
    }
    return belief;
  }

  /// The working set with object ids. One track of each object has its object's id.
  Objects objects() const {
    std::vector<ObjectBelief> beliefs;
    std::set<ObjectId> given;
    for (const auto& [track, belief] : working_) {
      beliefs.push_back(belief);
      beliefs.back().id = track;
      beliefs.back().track = 0;
      const auto member = members_.find(track);
      if (member == members_.end() || working_.contains(member->second)) continue;
      if (!given.insert(member->second).second) continue;
      beliefs.back().id = member->second;
      beliefs.back().track = track;
    }
    std::sort(beliefs.begin(), beliefs.end(),
              [](const ObjectBelief& a, const ObjectBelief& b) { return a.id < b.id; });
    Objects objects = workingSet(sequence_, std::move(beliefs), filter_);
    objects.stamp = stamp(sequence_);
    objects.world = world_;
    objects.T_WB = T_WB_;
    objects.next_id = next_id_;
    objects.near_source = near_source_;
    objects.near_revision = near_revision_;
    objects.near_m = near_m_;
    objects.ended = ended_;
    return objects;
  }

  /// A frame in which nothing new is detected.
  void publish() {
    hear();
    send(objects());
  }
  /// Publishes this number of frames at rest.
  void rest(int frames = 6) {
    for (int i = 0; i < frames; ++i) {
      ++sequence_;
      publish();
    }
  }

  virtual void send(const Objects& objects) {
    node_->onObjects(objects);
    node_->tick(objects.stamp.time.time_since_epoch());
  }
  /// Uses the map's messages since the previous frame.
  virtual void hear() {
    for (const MapNear& near : std::exchange(coming_, {})) use(near);
  }

  static FrameStamp stamp(std::uint64_t sequence) {
    return {42, sequence, fromNanoseconds(100'000'000 * static_cast<std::int64_t>(sequence)), 0};
  }

  void use(const MapNear& near) {
    if (near.client != filter_) return;
    next_id_ = std::max(next_id_, near.next_id);
    if (near.world != world_) return;
    if (near.instance == near_source_ && near.revision <= near_revision_) return;
    near_source_ = near.instance;
    near_revision_ = near.revision;
    kept_ = std::max(kept_, near.kept);
    std::erase_if(ended_, [&](const EndedTrack& e) { return e.time <= near.kept; });
    members_.clear();
    for (const Member& member : near.members) members_[member.track] = member.object;
    std::erase_if(fused_, [&](const auto& each) { return !working_.contains(each.second); });
    for (const auto* list : {&near.placed, &near.as_published}) {
      for (const ObjectBelief& belief : *list) takeUp(belief);
    }
    fuse();
  }

  /// Takes up an object that is not detected yet. A track that was detected since stays unchanged.
  void takeUp(const ObjectBelief& belief) {
    const TrackId track = belief.trackId();
    const auto there = working_.find(track);
    if (fused_.contains(track) || (there != working_.end() && !there->second.recalled)) return;
    working_[track] = belief;
    working_[track].recalled = true;
    if (const auto thing = thing_of_.find(track); thing != thing_of_.end()) {
      in_sight_.try_emplace(thing->second, track);
    }
  }

  /// Fuses the tracks of an object: the detected one survives.
  void fuse() {
    std::map<ObjectId, std::vector<TrackId>> tracks_of;
    for (const auto& [track, belief] : working_) {
      const auto member = members_.find(track);
      tracks_of[member == members_.end() ? track : member->second].push_back(track);
    }
    for (auto& [object, tracks] : tracks_of) {
      std::stable_sort(tracks.begin(), tracks.end(), [&](TrackId a, TrackId b) {
        return working_.at(a).recalled < working_.at(b).recalled;
      });
      for (std::size_t k = 1; k < tracks.size(); ++k) {
        working_.erase(tracks[k]);
        fused_[tracks[k]] = tracks.front();
        for (auto& [thing, track] : in_sight_) {
          if (track == tracks[k]) track = tracks.front();
        }
      }
    }
  }

  /// The filter deletes a confirmed track.
  void end(TrackId track) {
    working_.erase(track);
    forgetSight(track);
    ended_.push_back({track, 0, stamp(sequence_).time});
  }

  void forgetTracks() {
    in_sight_.clear();
    working_.clear();
    members_.clear();
    fused_.clear();
    coming_.clear();
  }
  /// The filter's process ends, and another one requests its working set.
  void restartFilter() {
    ++filter_;
    forgetTracks();
    ended_.clear();
    near_source_ = near_revision_ = 0;
    next_id_ = 1;
    kept_ = {};
    sayHello();
    hear();  // a filter waits for the answer before its first frame
  }
  void sayHello() {
    MapQuery query;
    query.client = filter_;
    query.request = ++request_;
    query.kind = MapQueryKind::kRestore;
    query.world = world_;
    query.limit = 1;
    node_->onQuery(query);
  }
  /// The store's process is killed, and another one starts with the file.
  void restartStore() {
    node_.reset();
    start();
  }

  ObjectBelief stored(ObjectId id) {
    node_->flush();
    MapQuery query;
    query.client = 3;
    query.request = ++request_;
    query.kind = MapQueryKind::kById;
    query.object_id = id;
    query.world = world_;  // objects as stored, each in its own W
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
  /// Ids of the objects on the map, for each true object.
  std::map<std::size_t, std::set<ObjectId>> idsOnTheMap() {
    node_->flush();
    std::map<std::size_t, std::set<ObjectId>> ids;
    for (const MapObject& object : answerTo({}).objects) {
      ids[thing_of_.at(object.id)].insert(object.id);
    }
    return ids;
  }
  std::multiset<ObjectId> idsInTiles() const {
    std::multiset<ObjectId> ids;
    for (const auto& [key, tile] : tiles_) {
      for (const MapObject& object : tile.objects) ids.insert(object.id);
    }
    return ids;
  }
  Eigen::Vector3d truthOf(ObjectId id) const { return things_[thing_of_.at(id)].p; }
  static Eigen::Vector3d placeOf(const MapObject& object) { return object.mean.head<3>(); }

  static bool has(const std::vector<ObjectBelief>& beliefs, ObjectId id) {
    return std::any_of(beliefs.begin(), beliefs.end(),
                       [&](const ObjectBelief& o) { return o.id == id; });
  }
  static bool hasAny(const MapNear& near, ObjectId id) {
    return has(near.placed, id) || has(near.as_published, id);
  }
  /// The object of a track, by `near`.
  static ObjectId objectOf(const MapNear& near, TrackId track) {
    const auto at = std::find_if(near.members.begin(), near.members.end(),
                                 [track](const Member& m) { return m.track == track; });
    return at == near.members.end() ? track : at->object;
  }
  bool givenOnceMore(ObjectId id, std::size_t after) const {
    return std::any_of(nears_.begin() + static_cast<std::ptrdiff_t>(after), nears_.end(),
                       [&](const MapNear& near) { return hasAny(near, id); });
  }

  /// A placed object that the body does not detect now.
  const ObjectBelief* unseenOf(const MapNear& near) const {
    for (const ObjectBelief& belief : near.placed) {
      if (!in_sight_.contains(thing_of_.at(belief.trackId()))) return &belief;
    }
    return nullptr;
  }

  TemporaryFolder folder_;
  Config config_;
  InstanceId store_ = 4, filter_ = 11;
  std::unique_ptr<Node> node_;
  std::map<std::array<std::int32_t, 3>, MapTile> tiles_;  ///< tiles as a late joiner receives them
  std::vector<MapReply> replies_;
  std::vector<MapNear> nears_;   ///< all messages so far
  std::vector<MapNear> coming_;  ///< those that the filter has not used yet
  Path path_ = onLap;
  std::vector<Thing> things_ = things();
  std::map<std::size_t, TrackId> in_sight_;
  std::map<TrackId, std::size_t> thing_of_;
  std::map<TrackId, ObjectBelief> working_;
  std::map<TrackId, ObjectId> members_;
  std::map<TrackId, TrackId> fused_;
  std::vector<EndedTrack> ended_;
  InstanceId near_source_ = 0;
  std::uint64_t near_revision_ = 0;
  TimePoint kept_;
  double near_m_ = 45.0;
  std::vector<MapFrame> frames_;
  std::vector<Event> events_;
  WorldId world_ = kHere;
  RigidTransform T_WB_;
  double way_m_ = 0.0, drift_ = kDrift;
  std::uint64_t sequence_ = 0, request_ = 0;
  ObjectId next_id_ = 1;
};

}  // namespace perdure::map_store::test
