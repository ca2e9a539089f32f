#include "services/semantic_filter/core/tracks/reidentify.h"

#include <gtest/gtest.h>

#include "services/semantic_filter/core/smoothing/keyframes.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeState;

TimePoint at(double seconds) { return fromNanoseconds(static_cast<std::int64_t>(1e9 * seconds)); }

class Reidentify : public ::testing::Test, protected testing::UsualFrame {
 protected:
  /// A confirmed track with five keyframes in the last half second, observed from the origin along
  /// x.
  Track thing(ObjectId id, const std::string& name, const State& x, double first, double last) {
    Track o;
    o.id = id;
    o.existence = {0.95, ExistenceEvidence::kPrior, at(last)};
    o.life.confirmed = o.life.once_confirmed = true;
    o.life.first_seen = at(first);
    o.life.last_seen = o.as_of = at(last);
    o.life.hits = 6;
    Hypothesis h;
    h.class_name = name;
    h.weight = 1.0;
    h.x = x;
    h.P.diagonal().setConstant(0.01);
    o.hypotheses = {h};
    View view;
    view.camera = &camera;
    for (int i = 0; i < 5; ++i) {
      Keyframe k;
      k.from = std::make_shared<const FrameView>(view, PoseError{}, at(last - 0.1 * i), nullptr);
      o.batch.keyframes.push_back(std::make_shared<const Keyframe>(k));
    }
    return o;
  }
  Track missing(ObjectId id, const std::string& name, const State& x, double last) {
    Track o = thing(id, name, x, 1.0, last);
    o.existence = {0.2, ExistenceEvidence::kPrior, at(last)};
    o.life.confirmed = false;
    return o;
  }

  std::vector<Track> none;  ///< deleted
  const State here = makeState(5, 0, 0.4, 0, 0.5, 0.5, 0.9);
  const State beside = makeState(5, 1.4, 0.4, 0, 0.5, 0.5, 0.9);
};

TEST_F(Reidentify, AMissingChairAndANewOneNearByAreOneThatWasMoved) {
  std::vector<Track> objects = {missing(3, "chair", here, 8.0),
                                thing(9, "chair", beside, 18.0, 19.0)};
  const auto merges = reidentify(objects, none, frame);
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_EQ(merges[0].survivor, 3u);
  EXPECT_EQ(merges[0].absorbed, 9u);
  EXPECT_TRUE(merges[0].moved);
  ASSERT_EQ(objects.size(), 1u);
  EXPECT_EQ(objects[0].id, 3u);
  EXPECT_EQ(objects[0].life.first_seen, at(1.0));
  EXPECT_EQ(objects[0].life.hits, 12u);
  EXPECT_TRUE(objects[0].life.confirmed);
  EXPECT_NEAR(objects[0].existence, 0.95, 1e-9);
  EXPECT_NEAR(objects[0].best().x[1], 1.4, 1e-9);
}

TEST_F(Reidentify, APresentChairOrAnotherClassOrAnEarlierTrackIsNotTheMissingOne) {
  for (const auto& pair : std::vector<std::vector<Track>>{
           {thing(3, "chair", here, 1.0, 8.0), thing(9, "chair", beside, 18.0, 19.0)},
           {missing(3, "chair", here, 8.0), thing(9, "couch", beside, 18.0, 19.0)},
           {missing(3, "chair", here, 8.0), thing(9, "chair", beside, 6.0, 19.0)},
           {missing(3, "chair", here, 8.0),
            thing(9, "chair", makeState(5, 4.0, 0.4, 0, 0.5, 0.5, 0.9), 18.0, 19.0)}}) {
    auto objects = pair;
    EXPECT_TRUE(reidentify(objects, none, frame).empty());
    EXPECT_EQ(objects.size(), 2u);
  }
}

TEST_F(Reidentify, ANewTrackInAPlaceNeverInViewWasNotMoved) {
  std::vector<Track> objects = {
      missing(3, "chair", makeState(1.2, 0, 0.4, 0, 0.5, 0.5, 0.9), 8.0),
      thing(9, "chair", makeState(-0.6, 0.5, 0.4, 0, 0.5, 0.5, 0.9), 18.0, 19.0)};
  EXPECT_TRUE(reidentify(objects, none, frame).empty());
}

TEST_F(Reidentify, OfTwoMissingTracksTheNearestIsTheOneThatWasMoved) {
  std::vector<Track> objects = {missing(2, "chair", makeState(5, -1.0, 0.4, 0, 0.5, 0.5, 0.9), 8.0),
                                missing(3, "chair", here, 8.0),
                                thing(9, "chair", beside, 18.0, 19.0)};
  const auto merges = reidentify(objects, none, frame);
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_EQ(merges[0].survivor, 3u);
  EXPECT_EQ(objects.size(), 2u);
}

TEST_F(Reidentify, ACarThatDrivesFromThePlaceOfAMissingOneIsThatCar) {
  const State parked = makeState(20, 3, 0.75, 0, 4.2, 1.75, 1.5);
  State driving = makeState(24, 3, 0.75, 0, 4.2, 1.75, 1.5);
  driving[kVelocity] = 4.0;
  Track newcomer = thing(9, "car", driving, 8.2, 9.0);
  newcomer.hypotheses[0].moving = true;
  std::vector<Track> objects = {missing(3, "car", parked, 8.0), newcomer};
  EXPECT_EQ(reidentify(objects, none, frame).size(), 1u);
  objects = {missing(3, "car", parked, 8.0), newcomer};
  objects[1].hypotheses[0].x[kVelocity] = -4.0;  // it comes from another position
  EXPECT_TRUE(reidentify(objects, none, frame).empty());
  objects = {missing(3, "car", parked, 4.0), newcomer};  // missing for too long
  EXPECT_TRUE(reidentify(objects, none, frame).empty());
  objects = {missing(3, "car", parked, 8.0), newcomer};
  objects[1].as_of = at(12.0);  // its later motion does not follow from its present velocity
  objects[1].hypotheses[0].x[0] = 36.0;
  EXPECT_TRUE(reidentify(objects, none, frame).empty());
}

/// A track with a wrong position, and a new moving track at the true position.
struct TakenOver {
  Track past, now;
};

class ReidentifyByBox : public Reidentify {
 protected:
  TakenOver pair() {
    TakenOver two{missing(3, "car", makeState(24, 3, 0.3, 0, 5.0, 2.0, 1.9), 8.0),
                  thing(9, "car", makeState(20, 2, 0.75, 0, 4.2, 1.75, 1.5), 8.1, 8.6)};
    two.now.hypotheses[0].moving = true;
    two.now.hypotheses[0].x[kVelocity] = 4.0;
    two.past.history.last_box = AssignedBox{at(8.0), {100, 100, 180, 160}};
    two.now.history.first_box = AssignedBox{at(8.1), {104, 102, 182, 160}};
    return two;
  }
  std::vector<MergeRecord> reunited(const TakenOver& two) {
    objects = {two.past, two.now};
    return reidentify(objects, none, frame);
  }
  std::vector<Track> objects;
};

TEST_F(ReidentifyByBox, AMovingTrackInTheBoxOfAMissingOneIsThatTrackWhateverItsPlace) {
  const auto merges = reunited(pair());
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_EQ(merges[0].survivor, 3u);
  EXPECT_TRUE(merges[0].moved);
  ASSERT_EQ(objects.size(), 1u);
  EXPECT_NEAR(objects[0].best().x[0], 20.0, 1e-9);
}

TEST_F(ReidentifyByBox, AnotherBoxOrALaterOneOrOneInTheSameImageIsAnotherObject) {
  TakenOver two = pair();
  two.now.history.first_box->box = {150, 100, 230, 160};
  EXPECT_TRUE(reunited(two).empty());
  two = pair();
  two.now.history.first_box->time = at(8.9);
  EXPECT_TRUE(reunited(two).empty());
  two = pair();
  two.now.history.first_box->time = at(8.0);
  EXPECT_TRUE(reunited(two).empty());
  two = pair();
  two.now.hypotheses[0].moving = false;
  EXPECT_TRUE(reunited(two).empty());
  two = pair();
  two.past.history.last_box.reset();  // it was recalled from the map
  EXPECT_TRUE(reunited(two).empty());
}

TEST_F(ReidentifyByBox, HoldsForRecentlyDeletedTracksToo) {
  const TakenOver two = pair();
  std::vector<Track> recently_deleted;
  keepDeleted(recently_deleted, {two.past}, at(8.1), parameters.tracks);
  objects = {two.now};
  objects[0].visibility.fraction = 1.0;
  const auto merges = reidentify(objects, recently_deleted, frame);
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_TRUE(merges[0].moved);
  EXPECT_FALSE(merges[0].returned);
  EXPECT_EQ(objects[0].id, 3u);
  EXPECT_TRUE(objects[0].best().moving);
  EXPECT_TRUE(recently_deleted.empty());
}

class ReidentifyDeleted : public Reidentify {
 protected:
  /// A track deleted at 10 s and last detected at 8 s.
  std::vector<Track> recently_deleted(const std::string& name, const State& x) {
    Track o = missing(3, name, x, 8.0);
    o.as_of = at(10.0);
    std::vector<Track> list;
    keepDeleted(list, {o}, at(10.0), parameters.tracks);
    return list;
  }
  std::vector<MergeRecord> after(std::vector<Track> past, const Track& newcomer) {
    objects = {newcomer};
    objects[0].visibility.fraction = 1.0;
    return reidentify(objects, past, frame);
  }
  std::vector<Track> objects;
};

TEST_F(ReidentifyDeleted, ANewTrackInThePlaceOfADeletedOneIsThatTrack) {
  const State almost = makeState(5.05, 0.05, 0.4, 0, 0.5, 0.5, 0.9);
  const auto merges = after(recently_deleted("chair", here), thing(9, "chair", almost, 11.0, 12.0));
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_EQ(merges[0].survivor, 3u);
  EXPECT_EQ(merges[0].absorbed, 9u);
  EXPECT_TRUE(merges[0].returned);
  ASSERT_EQ(objects.size(), 1u);
  EXPECT_EQ(objects[0].id, 3u);
  EXPECT_EQ(objects[0].life.first_seen, at(1.0));
  EXPECT_EQ(objects[0].life.last_seen, at(12.0));
  EXPECT_EQ(objects[0].life.hits, 12u);
  EXPECT_EQ(objects[0].visibility.fraction, 1.0);
  EXPECT_GE(objects[0].existence, 0.95);
  EXPECT_NEAR(objects[0].best().x[0], 5.025, 0.01) << "what was known of it counts";
}

TEST_F(ReidentifyDeleted, AnEstablishedTrackNeedsNoConfirmation) {
  Track newcomer = thing(9, "chair", here, 11.0, 12.0);
  newcomer.existence = {0.97, ExistenceEvidence::kPrior, at(12.0)};
  newcomer.life.confirmed = false;  // otherwise it is a larger object further away
  newcomer.hypotheses.push_back(
      thing(9, "dining table", makeState(12, 0, 0, 0, 2, 2, 2), 11.0, 12.0).best());
  newcomer.hypotheses[0].weight = 0.7, newcomer.hypotheses[1].weight = 0.3;
  EXPECT_EQ(after(recently_deleted("chair", here), newcomer).size(), 1u);
  newcomer.life.hits = 1;
  EXPECT_TRUE(after(recently_deleted("chair", here), newcomer).empty());
}

TEST_F(ReidentifyDeleted, NoOtherTrackIsTakenForIt) {
  const State out_of_reach = makeState(5, 3.0, 0.4, 0, 0.5, 0.5, 0.9);
  EXPECT_TRUE(
      after(recently_deleted("chair", here), thing(9, "chair", out_of_reach, 11.0, 12.0)).empty());
  EXPECT_TRUE(after(recently_deleted("car", here), thing(9, "chair", here, 11.0, 12.0)).empty());
  EXPECT_TRUE(after(recently_deleted("chair", here), thing(9, "chair", here, 7.0, 12.0)).empty())
      << "both were seen";
  EXPECT_TRUE(after(recently_deleted("chair", here), missing(9, "chair", here, 12.0)).empty());
}

TEST_F(ReidentifyDeleted, WhatWasCarriedWhileItWasDeletedIsThatTrack) {
  const auto merges = after(recently_deleted("chair", here), thing(9, "chair", beside, 11.0, 12.0));
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_TRUE(merges[0].moved);
  ASSERT_EQ(objects.size(), 1u);
  EXPECT_EQ(objects[0].id, 3u);
  EXPECT_NEAR(objects[0].best().x[1], 1.4, 1e-9) << "the old place says nothing of the new one";
}

TEST_F(ReidentifyDeleted, TheNearestPairIsTakenFirst) {
  std::vector<Track> past = recently_deleted("chair", here);
  objects = {thing(8, "chair", beside, 11.0, 12.0),
             thing(9, "chair", makeState(5.05, 0.05, 0.4, 0, 0.5, 0.5, 0.9), 11.0, 12.0)};
  for (Track& o : objects) o.visibility.fraction = 1.0;
  const auto merges = reidentify(objects, past, frame);
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_EQ(merges[0].absorbed, 9u);
  ASSERT_EQ(objects.size(), 2u);
  EXPECT_EQ(objects[0].id, 3u);
  EXPECT_EQ(objects[1].id, 8u);
  EXPECT_TRUE(past.empty());
}

TEST_F(ReidentifyDeleted, TracksNeverConfirmedOrLongDeletedAreForgotten) {
  Track guess = missing(3, "chair", here, 8.0);
  guess.life.once_confirmed = false;
  std::vector<Track> list;
  keepDeleted(list, {guess}, at(10.0), parameters.tracks);
  EXPECT_TRUE(list.empty());
  list = recently_deleted("chair", here);
  ASSERT_EQ(list.size(), 1u);
  keepDeleted(list, {}, at(9.9 + parameters.tracks.reidentify_s), parameters.tracks);
  EXPECT_EQ(list.size(), 1u);
  keepDeleted(list, {}, at(10.1 + parameters.tracks.reidentify_s), parameters.tracks);
  EXPECT_TRUE(list.empty());
}

}  // namespace
}  // namespace perdure::semantic_filter
