// A mapper whose process ends and starts again, and the state that is saved until then.
#include <gtest/gtest.h>

#include "common/mapping/graph/components.h"
#include "tests/common/mapping/synthetic_drive.h"

namespace perdure::mapping {
namespace {

using namespace test;

/// Largest differences between drives with and without a restart.
struct Apart {
  double metres = 0.0, radians = 0.0;
};

Apart apart(Drive& a, Drive& b) {
  Apart worst;
  EXPECT_EQ(keysOf(a.mapper().anchors()), keysOf(b.mapper().anchors()));
  for (const auto& [id, pose] : a.mapper().graph().poses()) {
    if (!b.mapper().graph().contains(id)) continue;
    const LevelError d = difference(pose, b.mapper().graph().pose(id));
    worst.metres = std::max(worst.metres, d.head<3>().norm());
    worst.radians = std::max(worst.radians, std::abs(d[3]));
  }
  return worst;
}

void expectSameLoops(const Drive& a, const Drive& b) {
  ASSERT_EQ(a.loops().size(), b.loops().size());
  for (std::size_t k = 0; k < a.loops().size(); ++k) {
    EXPECT_EQ(a.loops()[k].a, b.loops()[k].a) << k;
    EXPECT_EQ(a.loops()[k].b, b.loops()[k].b) << k;
    EXPECT_EQ(a.loops()[k].match.pairs, b.loops()[k].match.pairs) << k;
  }
}

/// Drives until an anchor was just set, so that no distance travelled is unsaved.
void toTheNextAnchor(Drive& drive) {
  const std::size_t before = drive.mapper().anchors().size();
  while (drive.mapper().anchors().size() == before) drive.to(drive.way_m() + 1.0);
}

TEST(Restart, AtAnAnchorItGoesOnAsIfItHadNeverStopped) {
  Drive whole(kDrifting);
  whole.toTheFirstLoop();
  ASSERT_FALSE(whole.loops().empty());
  for (const double at_m : {100.0, 340.0, 540.0}) {
    Drive broken(kDrifting);
    broken.to(at_m);
    toTheNextAnchor(broken);
    broken.restart();
    broken.toTheFirstLoop();
    expectSameLoops(whole, broken);
    const Apart off = apart(whole, broken);
    EXPECT_LT(off.metres, 1e-6) << at_m;
    EXPECT_LT(off.radians, 1e-9) << at_m;
  }
}

TEST(Restart, BetweenAnchorsItLosesNoMoreThanTheWaySince) {
  Drive whole(kDrifting), broken(kDrifting);
  for (const double at_m : {55.0, 207.0, 441.0, 555.0}) {
    broken.to(at_m);
    broken.restart();
  }
  whole.to(0.95 * kLap_m);
  broken.to(0.95 * kLap_m);
  EXPECT_EQ(broken.mapper().follows(kWorld), true);
  EXPECT_EQ(broken.mapper().along(kWorld).size(), broken.mapper().anchors().size());
  EXPECT_LT((whole.mapper().T_MW().p - broken.mapper().T_MW().p).norm(), 1e-6);
  whole.toTheEnd();
  broken.toTheEnd();
  ASSERT_FALSE(broken.loops().empty());
  EXPECT_EQ(broken.wrong(), 0u);
  EXPECT_LT(broken.off(), whole.off() + 1.0);
}

TEST(Restart, AfterALoopTheMapIsAsItWasAndCountsNoLoopTwice) {
  Drive whole(kDrifting), broken(kDrifting);
  whole.toTheFirstLoop();
  broken.toTheFirstLoop();
  whole.to(whole.way_m() + 60.0);
  broken.to(broken.way_m() + 60.0);
  const auto edges = broken.whole().edges.size();
  broken.restart();
  EXPECT_EQ(broken.whole().edges.size(), edges);
  broken.to(broken.way_m() + 100.0);
  whole.to(whole.way_m() + 100.0);
  EXPECT_EQ(broken.wrong(), 0u);
  EXPECT_EQ(componentsOf(broken.mapper().graph()).rbegin()->second, 1u);
  EXPECT_LT(std::abs(broken.off() - whole.off()), 0.5);
}

/// Loop closures scale the odometry's covariance. The scale applies to the past and the future
/// trajectory.
TEST(Restart, DoesNotScaleTheOdometryTwice) {
  const Settings timid{
      .seed = 4, .yaw_walk = 0.0015, .told_yaw_walk = 0.008, .way_m = 1.3 * kLap_m};
  Drive whole(timid), broken(timid);
  for (Drive* drive : {&whole, &broken}) {
    drive->toTheFirstLoop();
    ASSERT_FALSE(drive->loops().empty());
    drive->to(drive->way_m() + 30.0);
  }
  const auto share = [&](Drive& drive, AnchorId id) {
    return drive.mapper().anchors().at(id).from_previous.covariance(3, 3);
  };
  const double before = share(broken, 5);
  broken.restart();
  EXPECT_EQ(share(broken, 5), before);
  const std::size_t loops = broken.loops().size();
  whole.toTheEnd();
  broken.toTheEnd();
  ASSERT_GT(broken.loops().size(), loops);
  // The scale learned after the restart also applies to the trajectory before it. Both together are
  // reported as one scale.
  const auto scale = broken.mapper().anchors().rbegin()->second.scale;
  for (const auto& [id, anchor] : broken.mapper().anchors()) EXPECT_EQ(anchor.scale, scale) << id;
  EXPECT_NE(share(broken, 5), before) << "a loop came after it";
  EXPECT_GT(share(broken, 5), 0.9 * share(whole, 5)) << "loops of before are forgotten, no more";
  EXPECT_LT(scale.plane, 1.0);
}

TEST(Restart, WhatIsSavedInManyStepsIsAllOfIt) {
  Drive whole(kDrifting), saving(kDrifting);
  SavedMap stored;
  std::mt19937 random(5);
  double changed = 0.0, all = 0.0;
  while (whole.way_m() < 1.2 * kLap_m) {
    const double way_m = whole.way_m() + 1.0 + static_cast<double>(random() % 25);
    whole.to(way_m);
    saving.to(way_m);
    const Unsaved unsaved = saving.mapper().unsaved();
    apply(unsaved, stored);
    saving.mapper().markSaved();
    ASSERT_TRUE(isEmpty(saving.mapper().unsaved()));
    changed += static_cast<double>(unsaved.changed.records.size());
    all += static_cast<double>(stored.records.size());
    if (random() % 4 == 0) {
      const auto at = stored.records.begin();
      if (at != stored.records.end()) {
        const ObjectId id = at->first;
        whole.mapper().onGone(id);
        saving.mapper().onGone(id);
      }
    }
  }
  apply(saving.mapper().unsaved(), stored);
  ASSERT_FALSE(whole.loops().empty());
  expectSame(stored, whole.mapper().unsaved().changed);
  EXPECT_LT(changed, 0.5 * all) << "what has not changed is not written again";
}

TEST(Restart, EventsBeforeTheFirstPoseAreTaken) {
  Drive drive(kDrifting);
  drive.to(100.0);
  const SavedMap saved = drive.whole();
  ASSERT_GE(saved.records.size(), 4u);
  Mapper mapper(Parameters(), saved);
  auto at = saved.records.begin();
  const ObjectId survivor = (at++)->first, absorbed = (at++)->first, gone = (at++)->first;
  mapper.onMerged(survivor, absorbed);
  mapper.onMerged(survivor, 9999);
  mapper.onGone(gone);
  mapper.onGone(9999);
  EXPECT_TRUE(mapper.holds(survivor));
  EXPECT_FALSE(mapper.holds(absorbed));
  EXPECT_FALSE(mapper.holds(gone));
  EXPECT_FALSE(mapper.follows(kWorld));
  EXPECT_FALSE(mapper.frame());
  EXPECT_TRUE(mapper.near(Eigen::Vector3d::Zero(), 1e6).empty());
  EXPECT_EQ(mapper.unsaved().records_gone, (std::set<ObjectId>{absorbed, gone}));
}

/// The index of the other session must not offer objects that do not exist any more.
TEST(Restart, WhatIsMergedAwayWhileTheMapIsSearchedIsNotFound) {
  const Settings one{.seed = 1, .yaw_walk = 0.0005, .way_m = 300.0, .world = {1, 0}};
  Drive before(one);
  before.toTheEnd();
  const SavedMap saved = before.whole();
  std::size_t found = 0;
  for (const double late_m : {6.0, 12.0, 18.0}) {
    Settings two = one;
    two.noise = 9;
    two.world = {2, 0};
    two.from_m = 60.0;
    two.way_m = 120.0;
    Drive drive(two, saved, std::make_shared<Archive>(*before.archive()));
    drive.to(late_m);
    ASSERT_TRUE(drive.loops().empty()) << "it is being searched";
    // An event merges a third of the older objects into the first of them.
    const ObjectId survivor = saved.records.begin()->first;
    for (const auto& [id, record] : saved.records) {
      if (id != survivor && id % 3 == 0) drive.mapper().onMerged(survivor, id);
    }
    drive.toTheEnd();
    for (const LoopClosure& loop : drive.loops()) {
      for (const auto& [known, seen] : loop.match.pairs) EXPECT_NE(known % 3, 0u) << known;
      found += loop.match.pairs.size();
    }
  }
  EXPECT_GE(found, 12u);
}

}  // namespace
}  // namespace perdure::mapping
