// The tracks that leave the working set for the map store.
#include "services/semantic_filter/core/memory/archive.h"

#include <gtest/gtest.h>

#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeState;

constexpr MemoryParameters kMemory{true, 100.0, 30.0, 5.0};
constexpr double kStands = 0.7;  // m/s

TimePoint at(double seconds) { return TimePoint(durationFromSeconds(seconds)); }

Track thingAt(ObjectId id, double x, double seen_s) {
  Track o;
  o.id = id;
  o.life.confirmed = o.life.once_confirmed = true;
  o.existence = {0.97, ExistenceEvidence::kHit, at(seen_s)};
  o.life.last_seen = o.as_of = at(seen_s);
  Hypothesis h;
  h.class_name = "car";
  h.weight = 1.0;
  h.x = makeState(x, 0, 0.75, 0, 4, 2, 1.5);
  o.hypotheses = {h};
  return o;
}

struct Leavers {
  Archive memory{kMemory, kStands};
  /// A filter at the origin, and a map that stores everything at once.
  Archive::Leaving after(const std::vector<Track>& objects, double now_s = 20.0) {
    (void)memory.leaving(objects, Eigen::Vector3d::Zero(), at(now_s), at(now_s - 3.0));
    memory.onKept(at(now_s));
    return memory.leaving(objects, Eigen::Vector3d::Zero(), at(now_s + 0.1), at(now_s - 2.9));
  }
};

TEST(Archive, OnlyFarTracksOnTheMapThatWereLongNotDetectedLeave) {
  const auto leaving = Leavers().after(
      {thingAt(1, 140, 10), thingAt(2, 125, 10), thingAt(3, 140, 16), thingAt(4, 140, 10)});
  EXPECT_EQ(leaving.archived, (std::vector<ObjectId>{1, 4}));
  EXPECT_TRUE(leaving.forgotten.empty());
}

TEST(Archive, AMovingTrackIsForgottenOnceItIsFarAndNeverArchived) {
  Track driving = thingAt(1, 140, 10);
  driving.hypotheses[0].moving = true;
  driving.hypotheses[0].x.tail<3>() << 5, 0, 0;
  Track near = driving;
  near.id = 2;
  near.hypotheses[0].x[0] = 10;
  const auto leaving = Leavers().after({driving, near});
  EXPECT_TRUE(leaving.archived.empty());
  EXPECT_EQ(leaving.forgotten, (std::vector<ObjectId>{1}));
}

TEST(Archive, ATrackSlowerThanTheMovingThresholdIsArchived) {
  Track creeping = thingAt(1, 140, 10);
  creeping.hypotheses[0].moving = true;
  creeping.hypotheses[0].x.tail<3>() << 0.2, 0, 0;
  const auto leaving = Leavers().after({creeping});
  EXPECT_EQ(leaving.archived, (std::vector<ObjectId>{1}));
}

TEST(Archive, UnconfirmedTracksAreForgottenUnlessTheMapHasThem) {
  Track guess = thingAt(1, 140, 10);
  guess.life.confirmed = guess.life.once_confirmed = false;
  Track misplaced = thingAt(2, 140, 10);
  misplaced.life.confirmed = false;
  Track missing = misplaced;
  missing.id = 3;
  missing.existence = {0.3, ExistenceEvidence::kMiss, at(10)};
  const auto leaving = Leavers().after({guess, misplaced, missing});
  EXPECT_EQ(leaving.archived, (std::vector<ObjectId>{2}));
  EXPECT_EQ(leaving.forgotten, (std::vector<ObjectId>{1, 3}));
}

TEST(Archive, ATrackWaitsUntilTheMapHasAFrameFromWhenItCouldLeave) {
  Archive memory{kMemory, kStands};
  const std::vector<Track> things = {thingAt(1, 140, 10)};
  memory.onKept(at(14.0));
  for (double now = 16.0; now < 18.0; now += 0.1) {
    EXPECT_TRUE(
        memory.leaving(things, Eigen::Vector3d::Zero(), at(now), at(now - 3)).archived.empty());
    memory.onKept(at(13.0));
    EXPECT_EQ(memory.kept(), at(14.0)) << "a late message changes nothing";
  }
  memory.onKept(at(16.0));
  EXPECT_FALSE(memory.leaving(things, Eigen::Vector3d::Zero(), at(18), at(15)).archived.empty());
}

TEST(Archive, ObjectsComeNearerThanTheyLeave) {
  EXPECT_DOUBLE_EQ((Archive{kMemory, kStands}.nearRadius()), 110.0);
  EXPECT_DOUBLE_EQ((Archive{{false, 100.0, 30.0, 5.0}, kStands}.nearRadius()), 0.0);
}

TEST(Archive, TheProductOfAnArchivedTrackIsKeptByTheTimeOfItsState) {
  Archive memory{kMemory, kStands};
  Track track = thingAt(1, 140, 10);
  track.pose_product = 3.0 * Matrix6d::Identity();
  memory.rememberReference(track);
  ASSERT_TRUE(memory.referenceAt(track.as_of));
  EXPECT_EQ(*memory.referenceAt(track.as_of), track.pose_product);
  EXPECT_FALSE(memory.referenceAt(at(11)));
  memory.clear();
  EXPECT_FALSE(memory.referenceAt(track.as_of)) << "of another frame of reference";
}

}  // namespace
}  // namespace perdure::semantic_filter
