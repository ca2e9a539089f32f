// A body that drives laps among objects, with odometry that drifts, and a filter that recalls the
// tracks that the mapper has near the body. Several sessions on one map are possible, each with its
// own W.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "common/mapping/mapper.h"
#include "common/math/so3.h"
#include "tests/common/mapping/stored_map.h"

namespace perdure::mapping::test {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kSide_m = 150.0, kLap_m = 4.0 * kSide_m;
inline constexpr double kReach_m = 30.0;
inline const WorldId kWorld{7, 1};

/// A true object beside the road.
struct Thing {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double yaw = 0.0;
  std::string name;
};

/// The body's pose after `way_m` of laps, anticlockwise.
inline LevelPose onLap(double way_m) {
  const double s = std::fmod(way_m, kLap_m);
  const double side = std::floor(s / kSide_m), along = s - side * kSide_m;
  LevelPose corner;
  for (int i = 0; i < static_cast<int>(side); ++i) {
    corner = corner * LevelPose{{kSide_m, 0.0, 0.0}, 0.5 * kPi};
  }
  return corner * LevelPose{{along, 0.0, 0.0}, 0.0};
}

inline std::vector<Thing> thingsAlong(std::mt19937& random) {
  std::uniform_real_distribution<double> any(0.0, 1.0);
  std::vector<Thing> things;
  for (double s = 3.0; s < kLap_m; s += 5.0 + 8.0 * any(random)) {
    const bool car = any(random) < 0.6;
    const double side = any(random) < 0.5 ? -1.0 : 1.0;
    const LevelPose at = onLap(s);
    Thing thing;
    thing.p = at * Eigen::Vector3d(0.0, side * (car ? 4.0 : 5.0 + 3.0 * any(random)), 0.8);
    thing.yaw = car ? at.yaw : kPi * any(random);
    thing.name = car ? "car" : any(random) < 0.5 ? "person" : "van";
    things.push_back(thing);
  }
  return things;
}

struct Settings {
  std::uint32_t seed = 1;      ///< seed of the objects and the noise
  double yaw_walk = 0.0;       ///< true, rad/√m
  double told_yaw_walk = 0.0;  ///< declared; 0: the true value
  double way_m = 1.4 * kLap_m;
  std::uint32_t noise = 0;  ///< seed of the noise only; 0: continues from `seed`
  WorldId world = kWorld;
  double from_m = 0.0;       ///< start on the lap
  LevelPose T_WB = {};       ///< pose of the body at the start
  double clock_s = 0.0;      ///< time at the start
  std::size_t tracked = 99;  ///< `least_tracked`, unless it is 99
};

inline const Settings kDrifting{.seed = 4, .yaw_walk = 0.002};

/// The state that outlives a session, as in the store's file.
struct Archive {
  struct Stored {
    WorldId world;
    ObjectBelief belief;  ///< belief in the W of `world`
  };
  std::map<TrackId, Stored> stored;
  std::map<TrackId, std::size_t> thing_of;
  ObjectId next_id = 1;
};

/// Acts as the filter: has tracks of objects in view and draws ids for new ones. If it detects an
/// object at a position from the mapper, it continues that track. A track never changes its id.
class Drive {
 public:
  explicit Drive(const Settings& settings, SavedMap saved = {},
                 std::shared_ptr<Archive> archive = std::make_shared<Archive>())
      : settings_(settings),
        random_(settings.seed),
        things_(thingsAlong(random_)),
        begun_with_(std::move(saved)),
        mapper_(std::make_unique<Mapper>(parametersOf(settings), begun_with_)),
        archive_(std::move(archive)),
        T_WB_(settings.T_WB) {
    in_sight_.resize(things_.size());
    if (settings.noise > 0) random_.seed(settings.noise);
  }
  /// Starts with the map of another drive.
  Drive(const Settings& settings, const Drive& before)
      : Drive(settings, before.whole(), before.archive_) {}

  static Parameters parametersOf(const Settings& settings) {
    Parameters parameters;
    const double told = settings.told_yaw_walk > 0.0 ? settings.told_yaw_walk : settings.yaw_walk;
    if (told > 0.0) parameters.anchor.walk_yaw = told;
    if (settings.tracked != 99) parameters.loop.least_tracked = settings.tracked;
    return parameters;
  }

  void to(double way_m) {
    while (way_m_ < way_m) step();
  }
  void toTheEnd() { to(settings_.way_m); }
  void toTheFirstLoop() {
    while (loops_.empty() && way_m_ < settings_.way_m) step();
  }

  /// The mapper's process ends and starts again with the saved state.
  void restart() {
    begun_with_ = whole();
    mapper_ = std::make_unique<Mapper>(parametersOf(settings_), begun_with_);
  }
  /// The complete state of the mapper, unless it was marked as saved.
  SavedMap whole() const {
    SavedMap map = begun_with_;
    apply(mapper_->unsaved(), map);
    return map;
  }
  /// Restarts with another map.
  void restartOn(SavedMap map) {
    begun_with_ = std::move(map);
    mapper_ = std::make_unique<Mapper>(parametersOf(settings_), begun_with_);
  }
  /// From now on the filter exchanges the ids of two tracks.
  void confuse(TrackId a, TrackId b) {
    told_as_[a] = b;
    told_as_[b] = a;
  }

  LevelPose truth() const { return onLap(settings_.from_m + way_m_); }
  const LevelPose& odometry() const { return T_WB_; }
  double way_m() const { return way_m_; }
  Mapper& mapper() { return *mapper_; }
  const Settings& settings() const { return settings_; }
  const std::shared_ptr<Archive>& archive() const { return archive_; }
  const std::vector<LoopClosure>& loops() const { return loops_; }
  const std::vector<LoopWithdrawal>& withdrawn() const { return withdrawn_; }
  const std::vector<MergeOrder>& splits() const { return splits_; }
  /// Error of the body's position in M before the message that closed the first loop; the next
  /// function returns the error after it.
  double offBefore() const { return off_before_; }
  double offAfter() const { return off_after_; }
  double off() const { return (mapper_->T_MW() * T_WB_.p - truth().p).norm(); }
  /// The true object of each track.
  const std::map<TrackId, std::size_t>& things() const { return archive_->thing_of; }
  const Thing& thing(TrackId id) const { return things_[things().at(id)]; }
  ObjectId objectOf(TrackId id) const { return mapper_->identity().objectOf(id); }
  /// Number of merges of the same true object; the next function counts merges of two true objects.
  std::size_t right() const { return right_; }
  std::size_t wrong() const { return wrong_; }
  /// Number of objects of the first lap that were detected again as the same track.
  std::size_t recalled() const { return recalled_; }
  std::size_t renamed() const { return renamed_; }
  /// The last belief of a track, in W.
  const ObjectBelief& stored(TrackId id) const { return archive_->stored.at(id).belief; }
  /// Tracks of the working set.
  std::vector<TrackId> inSight() const {
    std::vector<TrackId> ids;
    for (const Sight& sight : in_sight_) {
      if (sight.id != 0) ids.push_back(sight.id);
    }
    return ids;
  }

 private:
  struct Sight {
    TrackId id = 0;  ///< 0: not in the working set
    Eigen::Vector4d error = Eigen::Vector4d::Zero();
    TimePoint first, last;
    std::uint32_t hits = 0;
    double last_way_m = 0.0;
  };

  double normal(double deviation) {
    return deviation * std::normal_distribution<double>()(random_);
  }

  void step() {
    constexpr double kStep_m = 1.0;
    const LevelPose before = truth();
    way_m_ += kStep_m;
    LevelPose increment = before.inverse() * truth();
    increment.yaw += normal(settings_.yaw_walk);
    T_WB_ = T_WB_ * increment;
    ++sequence_;
    mapper_->onOdometry(odometryMessage());
    const double off_before = off();
    mapper_->onObjects(objectsMessage());
    const MapChange change = mapper_->takeChange();
    if (loops_.empty() && !change.loops.empty()) {
      off_before_ = off_before;
      off_after_ = off();
    }
    loops_.insert(loops_.end(), change.loops.begin(), change.loops.end());
    withdrawn_.insert(withdrawn_.end(), change.withdrawn.begin(), change.withdrawn.end());
    splits_.insert(splits_.end(), change.splits.begin(), change.splits.end());
    for (const MergeOrder& merge : change.merges) count(merge);
  }

  FrameStamp stamp() const {
    const double time_s = settings_.clock_s + 0.1 * static_cast<double>(sequence_);
    return {1, sequence_, TimePoint(durationFromSeconds(time_s)), 0};
  }

  Odometry odometryMessage() const {
    Odometry o;
    o.stamp = stamp();
    o.world = settings_.world;
    o.state = OdometryState::kTracking;
    o.T_WB = T_WB_.rigid();
    return o;
  }

  static Eigen::Vector4d deviations() { return {0.15, 0.15, 0.08, 0.12}; }

  Objects objectsMessage() {
    Objects objects;
    objects.stamp = stamp();
    objects.world = settings_.world;
    objects.T_WB = T_WB_.rigid();
    const LevelPose T_BM = truth().inverse();
    std::map<TrackId, Recallable> offered;
    for (const Recallable& there : mapper_->near(T_WB_.p, 60.0)) offered[there.track] = there;
    for (std::size_t i = 0; i < things_.size(); ++i) {
      Sight& sight = in_sight_[i];
      const Eigen::Vector3d p_B = T_BM * things_[i].p;
      const bool seen = p_B.x() > 2.0 && p_B.norm() < kReach_m;
      if (seen) {
        if (sight.id == 0) begin(i, p_B, offered);
        sight.last = stamp().time;
        sight.last_way_m = way_m_;
        ++sight.hits;
        archive_->stored[sight.id] = {settings_.world, beliefOf(i, p_B)};
      } else if (sight.id != 0 && way_m_ - sight.last_way_m > 40.0) {
        sight = {};
      }
      if (sight.id == 0) continue;
      objects.objects.push_back(stored(sight.id));
      const auto as = told_as_.find(sight.id);
      if (as != told_as_.end()) objects.objects.back().id = as->second;
    }
    objects.next_id = archive_->next_id;
    return objects;
  }

  void begin(std::size_t i, const Eigen::Vector3d& p_B,
             const std::map<TrackId, Recallable>& offered) {
    Sight& sight = in_sight_[i];
    sight = {};
    for (double& e : sight.error) e = normal(1.0);
    sight.error = (sight.error.array() * deviations().array()).matrix().eval();
    sight.first = stamp().time;
    double nearest_m = 2.5;
    for (const auto& [id, there] : offered) {
      if (!archive_->stored.contains(id) || stored(id).best().name != things_[i].name) continue;
      if (!there.T_now && archive_->stored.at(id).world != settings_.world) continue;
      const Eigen::Vector3d before = stored(id).best().mean.head<3>();
      const Eigen::Vector3d laid = there.T_now ? *there.T_now * before : before;
      const double apart_m = (laid - T_WB_ * p_B).head<2>().norm();
      if (apart_m > nearest_m) continue;
      nearest_m = apart_m;
      sight.id = id;
    }
    auto& thing_of = archive_->thing_of;
    const bool again = std::any_of(thing_of.begin(), thing_of.end(),
                                   [&](const auto& known) { return known.second == i; });
    if (sight.id == 0) {
      sight.id = archive_->next_id++;
      if (again) ++renamed_;
    } else if (thing_of.at(sight.id) == i) {
      ++recalled_;
    } else {
      ++wrong_;
    }
    thing_of[sight.id] = i;
  }

  ObjectBelief beliefOf(std::size_t i, const Eigen::Vector3d& p_B) const {
    const Sight& sight = in_sight_[i];
    ObjectBelief belief;
    belief.id = sight.id;
    belief.existence = 0.95;
    belief.confirmed = sight.hits >= 3;
    belief.hits = sight.hits;
    belief.first_seen = sight.first;
    belief.last_seen = belief.as_of = sight.last;
    ClassBelief c;
    c.name = things_[i].name;
    c.probability = 0.9;
    c.mean.head<3>() = T_WB_ * (p_B + sight.error.head<3>());
    c.mean[3] = wrapAngle(things_[i].yaw - truth().yaw + T_WB_.yaw + sight.error[3]);
    c.covariance = 0.01 * Matrix7d::Identity();
    c.covariance.topLeftCorner<4, 4>() = deviations().array().square().matrix().asDiagonal();
    ClassBelief other = c;
    other.name = kOtherClass;
    other.probability = 0.1;
    belief.classes = {c, other};
    return belief;
  }

  void count(const MergeOrder& merge) {
    const auto survivor = things().find(merge.survivor), absorbed = things().find(merge.absorbed);
    ASSERT_TRUE(survivor != things().end() && absorbed != things().end());
    EXPECT_LT(merge.survivor, merge.absorbed);
    ++(survivor->second == absorbed->second ? right_ : wrong_);
  }

  Settings settings_;
  std::mt19937 random_;
  std::vector<Thing> things_;
  SavedMap begun_with_;
  std::unique_ptr<Mapper> mapper_;
  std::shared_ptr<Archive> archive_;
  std::vector<Sight> in_sight_;
  std::map<TrackId, TrackId> told_as_;
  LevelPose T_WB_;
  double way_m_ = 0.0, off_before_ = 0.0, off_after_ = 0.0;
  std::uint64_t sequence_ = 0;
  std::vector<LoopClosure> loops_;
  std::vector<LoopWithdrawal> withdrawn_;
  std::vector<MergeOrder> splits_;
  std::size_t right_ = 0, wrong_ = 0, recalled_ = 0, renamed_ = 0;
};

}  // namespace perdure::mapping::test
