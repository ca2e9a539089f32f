// Loop closures from the appearance of places only: a drive without objects.
#include "common/mapping/view_search.h"

#include <gtest/gtest.h>

#include <random>

#include "common/math/so3.h"
#include "tests/common/mapping/synthetic_drive.h"

namespace perdure::mapping {
namespace {

using namespace test;

/// A wall of marks along the lap. The body observes the marks ahead, with odometry that drifts.
class Marks {
 public:
  explicit Marks(std::uint32_t seed, bool alike = false) : random_(seed) {
    std::uniform_real_distribution<double> any(0.0, 1.0);
    for (double s = 0.0; s < kLap_m; s += 0.8) {
      const double side = any(random_) < 0.5 ? -1.0 : 1.0;
      Mark mark;
      mark.p =
          onLap(s) * Eigen::Vector3d(0.0, side * (5.0 + 6.0 * any(random_)), 4.0 * any(random_));
      for (auto& byte : mark.descriptor) byte = static_cast<std::uint8_t>(random_());
      marks_.push_back(mark);
    }
    if (alike) {  // each side of the lap resembles the first
      const std::size_t side = marks_.size() / 4;
      for (std::size_t k = side; k < marks_.size(); ++k) {
        marks_[k].descriptor = marks_[k % side].descriptor;
        const LevelPose turn = onLap(kSide_m * static_cast<double>(k / side));
        marks_[k].p = turn * marks_[k % side].p;
      }
    }
  }

  void drive(Mapper& mapper, double to_m, double yaw_walk, const WorldId& world = kWorld) {
    while (way_m_ < to_m) {
      const LevelPose before = onLap(way_m_);
      way_m_ += 1.0;
      LevelPose increment = before.inverse() * onLap(way_m_);
      increment.yaw += yaw_walk * normal();
      T_WB_ = T_WB_ * increment;
      ++sequence_;
      const FrameStamp stamp{1, sequence_, TimePoint(durationFromSeconds(0.1 * sequence())), 0};
      Odometry odometry;
      odometry.stamp = stamp;
      odometry.world = world;
      odometry.state = OdometryState::kTracking;
      odometry.T_WB = T_WB_.rigid();
      mapper.onOdometry(odometry);
      mapper.onLandmarks(seen(stamp, world));
      Objects none;
      none.stamp = stamp;
      none.world = world;
      none.T_WB = odometry.T_WB;
      mapper.onObjects(none);
      const MapChange change = mapper.takeChange();
      loops_.insert(loops_.end(), change.loops.begin(), change.loops.end());
    }
  }
  /// Begins another session at the present position, with its own W.
  void beginAnew() { T_WB_ = {{40.0, -7.0, 0.0}, 1.1}; }

  const std::vector<LoopClosure>& loops() const { return loops_; }
  double off(const Mapper& mapper) const {
    return (mapper.T_MW() * T_WB_.p - onLap(way_m_).p).norm();
  }
  double offByOdometry() const { return (T_WB_.p - onLap(way_m_).p).norm(); }

 private:
  struct Mark {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    Descriptor descriptor{};
  };

  double sequence() const { return static_cast<double>(sequence_); }
  double normal() { return std::normal_distribution<double>()(random_); }

  Landmarks seen(const FrameStamp& stamp, const WorldId& world) {
    Landmarks landmarks;
    landmarks.stamp = stamp;
    landmarks.world = world;
    const LevelPose T_BM = onLap(way_m_).inverse();
    for (std::size_t k = 0; k < marks_.size(); ++k) {
      const Eigen::Vector3d p_B = T_BM * marks_[k].p;
      if (p_B.x() < 3.0 || p_B.norm() > 25.0) continue;
      Landmark landmark;
      landmark.id = k;
      landmark.p_W = T_WB_ * (p_B + 0.1 * Eigen::Vector3d(normal(), normal(), normal()));
      landmark.covariance = 0.01 * Eigen::Matrix3d::Identity();
      landmark.descriptor = marks_[k].descriptor;
      for (int i = 0; i < 20; ++i) {
        const auto bit = random_() % 256;
        landmark.descriptor[bit / 8] =
            static_cast<std::uint8_t>(landmark.descriptor[bit / 8] ^ (1U << (bit % 8)));
      }
      landmarks.landmarks.push_back(landmark);
    }
    return landmarks;
  }

  std::mt19937 random_;
  std::vector<Mark> marks_;
  LevelPose T_WB_;
  double way_m_ = 0.0;
  std::uint64_t sequence_ = 0;
  std::vector<LoopClosure> loops_;
};

LevelPose trueAt(const Mapper& mapper, AnchorId anchor) {
  return onLap(10.0 * toSeconds(mapper.anchors().at(anchor).stamp.time));
}

Parameters drifting() {
  Parameters parameters;
  parameters.anchor.walk_yaw = 0.001;
  return parameters;
}

TEST(ViewSearch, ClosesALoopWhereNoObjectIs) {
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    Marks marks(seed);
    Mapper mapper(drifting());
    marks.drive(mapper, 1.4 * kLap_m, 0.001);
    ASSERT_FALSE(marks.loops().empty()) << seed;
    EXPECT_TRUE(marks.loops().front().match.pairs.empty());
    EXPECT_GE(marks.loops().front().match.points, 8u);
    EXPECT_LT(marks.off(mapper), 0.7) << seed << ", by odometry " << marks.offByOdometry();
    EXPECT_LT(marks.off(mapper), 0.5 * marks.offByOdometry()) << seed;
    for (const auto& [id, edge] : mapper.graph().edges()) {
      if (edge.kind != EdgeKind::kLoop) continue;
      const LevelPose T_ab = trueAt(mapper, edge.a).inverse() * trueAt(mapper, edge.b);
      EXPECT_LT(difference(edge.T_ab.mean, T_ab).head<2>().norm(), 1.0) << seed << ", " << id;
    }
  }
}

TEST(ViewSearch, AStreetThatLooksTheSameOnEachSideClosesNoWrongLoop) {
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    Marks marks(seed, true);
    Mapper mapper(drifting());
    marks.drive(mapper, 1.4 * kLap_m, 0.001);
    for (const auto& [id, edge] : mapper.graph().edges()) {
      if (edge.kind != EdgeKind::kLoop) continue;
      const LevelPose T_ab = trueAt(mapper, edge.a).inverse() * trueAt(mapper, edge.b);
      EXPECT_LT(difference(edge.T_ab.mean, T_ab).head<2>().norm(), 3.0) << seed << ", " << id;
    }
  }
}

TEST(ViewSearch, FindsAnotherSessionsPlaceAfterARestart) {
  Marks marks(5);
  SavedMap saved;
  {
    Mapper mapper(drifting());
    marks.drive(mapper, 1.1 * kLap_m, 0.0005);
    apply(mapper.unsaved(), saved);
  }
  EXPECT_GT(saved.views.size(), 30u);
  for (const auto& [id, view] : saved.views) EXPECT_LE(view.size(), kMostPoints);
  Mapper mapper(drifting(), saved);
  marks.beginAnew();
  const WorldId next{8, 1};
  marks.drive(mapper, 1.3 * kLap_m, 0.0005, next);
  ASSERT_FALSE(marks.loops().empty());
  EXPECT_TRUE(std::any_of(marks.loops().begin(), marks.loops().end(),
                          [](const LoopClosure& loop) { return loop.joins; }));
  EXPECT_LT(marks.off(mapper), 2.0);
}

TEST(ViewSearch, WhereFourStreetsLookAlikeItDoesNotGuess) {
  Marks marks(5, true);
  SavedMap saved;
  {
    Mapper mapper(drifting());
    marks.drive(mapper, 1.1 * kLap_m, 0.0005);
    apply(mapper.unsaved(), saved);
  }
  Mapper mapper(drifting(), saved);
  marks.beginAnew();
  marks.drive(mapper, 1.5 * kLap_m, 0.0005, {8, 1});
  for (const LoopClosure& loop : marks.loops()) EXPECT_FALSE(loop.joins);
}

/// At an anchor of the second lap, with the landmarks observed from there.
TEST(ViewSearch, AViewContradictsALoopThatLeadsElsewhereAndNotATrueOne) {
  Marks marks(4);
  Mapper mapper(drifting());
  marks.drive(mapper, 1.4 * kLap_m, 0.0005);
  SavedMap saved;
  apply(mapper.unsaved(), saved);
  const Parameters parameters = drifting();
  const MapState state(parameters, saved);
  const auto& [here, seen] = *saved.views.rbegin();
  AnchorBuilder way(parameters.anchor);
  way.resume(saved.anchors.at(here).anchor);
  ASSERT_GT(way.way_m(), 1.2 * kLap_m);
  const Marginals relative(state.graph(), here);
  const Whereabouts body{state, way, relative};
  const ViewSearch search(parameters);
  LoopSearch::Found found;
  found.home = saved.anchors.begin()->first;
  found.match.T_MB.mean = state.graph().pose(here);
  EXPECT_FALSE(search.contradicts(found, body, seen)) << "where it is";
  found.match.T_MB.mean.p.x() += 8.0;
  EXPECT_TRUE(search.contradicts(found, body, seen)) << "eight metres off";
  EXPECT_FALSE(search.contradicts(found, body, {})) << "nothing is seen";
}

}  // namespace
}  // namespace perdure::mapping
