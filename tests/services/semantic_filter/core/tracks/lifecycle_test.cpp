#include "services/semantic_filter/core/tracks/lifecycle.h"

#include <gtest/gtest.h>

#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeObject;
using testing::makeState;

class Lifecycle : public ::testing::Test, protected testing::UsualFrame {};

TEST_F(Lifecycle, ATrackWithTwoPossiblePlacesIsNotConfirmed) {
  // A large distant object or a small near one; each has a certain position.
  const auto claimed = [&](double far_off, double weight) {
    Track o = makeObject(1, "car", makeState(30, 0, 0.7, 0, 4, 1.8, 1.5), 0.04);
    o.existence = {0.97, ExistenceEvidence::kPrior, o.as_of};
    o.hypotheses.push_back(
        makeObject(1, kOtherClass, makeState(30 - far_off, 0, 1.0, 0, 2, 0.9, 0.8), 0.04).best());
    o.hypotheses[0].weight = 1.0 - weight;
    o.hypotheses[1].weight = weight;
    std::vector<Track> objects{o};
    confirmAndDelete(objects, frame);
    return objects.at(0).life.confirmed;
  };
  EXPECT_TRUE(claimed(0.5, 0.4));
  EXPECT_FALSE(claimed(15.0, 0.4));
  EXPECT_TRUE(claimed(15.0, 0.001)) << "that it is near is ruled out";
}

TEST_F(Lifecycle, WhatMayBeAnObjectThatWasSeenInPartWaits) {
  // From behind a nearer car, the end of the older one looked like a narrow car.
  const auto claimed = [&](double beside_m, std::uint64_t older_frames, bool older_confirmed,
                           TrackId hidden_by = 0) {
    Track older = makeObject(1, "car", makeState(20, 0, 0.7, 0, 4, 1.7, 1.5), 0.04);
    older.life.confirmed = older.life.once_confirmed = older_confirmed;
    older.history.detected = older_frames;
    Track newer = makeObject(2, "car", makeState(20, beside_m, 0.7, M_PI / 2, 4, 1.7, 1.5), 0.04);
    newer.history.detected = 0b1;
    for (Track* o : {&older, &newer}) {
      o->existence = {0.97, ExistenceEvidence::kPrior, o->as_of};
    }
    if (!older_confirmed) older.existence = {0.4, ExistenceEvidence::kPrior, older.as_of};
    if (hidden_by > 0) {
      older.visibility.fraction = 0.0;
      older.visibility.blocked_by = hidden_by;
    }
    std::vector<Track> tracks{older, newer};
    confirmAndDelete(tracks, frame);
    return tracks.back().life.confirmed;
  };
  EXPECT_FALSE(claimed(1.2, 0b10, true));
  EXPECT_TRUE(claimed(1.2, 0b11, true)) << "one frame detected both";
  EXPECT_TRUE(claimed(3.0, 0b10, true)) << "it stands beside the older one";
  EXPECT_TRUE(claimed(1.2, 0b10, false)) << "the older one is no longer believed";
  EXPECT_FALSE(claimed(1.2, 0b10, true, 2)) << "the newer one hides the older one";
  EXPECT_TRUE(claimed(1.2, 0b10, true, 7)) << "nothing is known of a hidden one";
}

TEST_F(Lifecycle, DetectionOnAnotherVisitRaisesTheLimitOfExistence) {
  Track o = makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.004);
  EXPECT_EQ(existenceCeiling(o, parameters.tracks), parameters.tracks.certain);
  o.life.detected_on_revisit = true;
  EXPECT_EQ(existenceCeiling(o, parameters.tracks), parameters.tracks.certain_again);
  EXPECT_GT(parameters.tracks.certain_again, parameters.tracks.certain);
}

TEST_F(Lifecycle, AnInvisibleTrackOfOneHitIsDeletedAndAConfirmedOneIsKept) {
  const auto hiddenFor = [&](double seconds, std::uint32_t hits, bool confirmed) {
    Track o = makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.04);
    o.life.hits = hits;
    o.life.confirmed = o.life.once_confirmed = confirmed;
    o.visibility.fraction = 0.0;
    o.unused.occluded.count = 5;
    o.unused.occluded.last = o.life.last_seen + Duration(static_cast<std::int64_t>(1e9 * seconds));
    std::vector<Track> objects{o};
    confirmAndDelete(objects, frame);
    return objects.size();
  };
  const double patience = parameters.tracks.tentative_s;
  EXPECT_EQ(hiddenFor(patience + 1.0, 1, false), 0u);
  EXPECT_EQ(hiddenFor(patience - 1.0, 1, false), 1u);
  EXPECT_EQ(hiddenFor(patience + 1.0, 30, false), 1u) << "much is known of it";
  EXPECT_EQ(hiddenFor(patience + 1.0, 3, true), 1u);
}

TEST_F(Lifecycle, AnUnseenMoverIsConfirmedOnlyWhileItsPlaceIsKnown) {
  const auto confirmedAfter = [&](double seconds, bool moving, double probability = 1.0) {
    Track o = makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.04);
    o.life.confirmed = o.life.once_confirmed = true;
    o.visibility.fraction = 0.0;
    Hypothesis& h = o.hypotheses[0];
    h.moving = moving;
    if (moving) {
      h.x[kVelocity] = 3.0;
      h.P.bottomRightCorner<3, 3>().diagonal().setConstant(0.25);
    }
    h.weight = probability;
    if (probability < 1.0) {
      o.hypotheses.push_back(h);
      o.hypotheses.back().moving = !moving;
      o.hypotheses.back().weight = 1.0 - probability;
    }
    FrameInput later;
    later.stamp.time = o.as_of + Duration(static_cast<std::int64_t>(1e9 * seconds));
    std::vector<Track> tracks{o};
    withdrawLostMovers(tracks, later, parameters);
    return tracks.at(0).life.confirmed;
  };
  EXPECT_TRUE(confirmedAfter(0.3, true));
  EXPECT_FALSE(confirmedAfter(20.0, true));
  EXPECT_TRUE(confirmedAfter(20.0, false));
  EXPECT_TRUE(confirmedAfter(20.0, true, 0.05)) << "it most probably stands";
}

}  // namespace
}  // namespace perdure::semantic_filter
