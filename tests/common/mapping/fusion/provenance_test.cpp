#include "common/mapping/fusion/provenance.h"

#include <gtest/gtest.h>

#include "tests/common/mapping/fusion/drives.h"

namespace perdure::mapping {
namespace {

constexpr SessionIdentity kElsewhere{71, 72};

class OfProvenance : public ::testing::Test {
 protected:
  TimePoint later() const { return belief().last_seen + durationFromSeconds(5.0); }
  ObjectBelief& belief() { return map_.objects.at(id_).belief; }
  const ObjectBelief& belief() const { return map_.objects.at(id_).belief; }
  Origin elsewhere(ObjectId id, TimePoint last) const {
    return {kElsewhere, id, id_, belief().first_seen, last};
  }

  MapContents map_ = test::mapOfAShortDrive();
  ObjectId id_ = map_.objects.begin()->first;
};

TEST_F(OfProvenance, AnObjectRestsOnItselfWhileNothingIsTold) {
  const Provenance provenance(map_);
  ASSERT_EQ(provenance.of(id_).size(), 1u);
  const Origin own = provenance.of(id_).front();
  EXPECT_EQ(own, provenance.nameOf(id_));
  EXPECT_TRUE(provenance.covers(id_, own));
  Origin newer = own;
  newer.last_seen = later();
  EXPECT_FALSE(provenance.covers(id_, newer));
  EXPECT_FALSE(provenance.covers(id_, elsewhere(id_, own.last_seen)));
}

TEST_F(OfProvenance, WhatIsToldIsAllUntilItsBeliefIsNewer) {
  map_.origins = {elsewhere(900, belief().last_seen)};
  EXPECT_EQ(Provenance(map_).of(id_), map_.origins);
  const TimePoint now = belief().last_seen = later();
  const auto all = Provenance(map_).of(id_);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all.back().last_seen, now) << "it was followed here since";
  EXPECT_EQ(all.back().id, id_);
}

TEST_F(OfProvenance, ARowIsFollowedFurtherAndNotDoubled) {
  Provenance provenance(map_);
  provenance.add(elsewhere(900, belief().last_seen));
  provenance.add(elsewhere(900, later()));
  provenance.add(elsewhere(900, belief().last_seen));
  ASSERT_EQ(provenance.told().size(), 1u);
  EXPECT_EQ(provenance.told().front().last_seen, later());
}

TEST_F(OfProvenance, MergedObjectsCountForTheSurvivor) {
  const ObjectId absorbed = std::next(map_.objects.begin())->first;
  map_.objects.at(absorbed).ended = Ending{EventKind::kMerged, later(), id_};
  Origin of_absorbed = elsewhere(900, belief().last_seen);
  of_absorbed.now = absorbed;
  map_.origins = {of_absorbed};
  const Provenance provenance(map_);
  EXPECT_TRUE(provenance.covers(id_, of_absorbed));
  EXPECT_EQ(provenance.find(of_absorbed).id, absorbed);
}

TEST_F(OfProvenance, IsFoundByWhatIsToldAndByTheSameIdOfTheSameMap) {
  map_.origins = {elsewhere(900, belief().last_seen)};
  const Provenance provenance(map_);
  EXPECT_EQ(provenance.find(elsewhere(900, later())).id, id_);
  EXPECT_TRUE(provenance.find(elsewhere(900, later())).told);
  const Known by_id = provenance.find(provenance.nameOf(id_));
  EXPECT_EQ(by_id.id, id_);
  EXPECT_FALSE(by_id.told);
  Origin another = provenance.nameOf(id_);
  another.first_seen += Duration(1);
  EXPECT_EQ(provenance.find(another).id, 0u) << "an id that was given twice";
  EXPECT_EQ(provenance.find(elsewhere(901, later())).id, 0u);
}

TEST_F(OfProvenance, TellsWhatABeliefSaysOfItselfOnce) {
  Provenance provenance(map_);
  const Origin own = provenance.nameOf(id_);
  provenance.tell(id_);
  provenance.tell(id_);
  ASSERT_EQ(provenance.told(), std::vector<Origin>{own});
}

}  // namespace
}  // namespace perdure::mapping
