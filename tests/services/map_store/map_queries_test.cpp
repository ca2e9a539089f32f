// Compares answers of the R*Tree with a search of all objects.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "services/map_store/core/map_database.h"
#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store {
namespace {

using test::carAt;
using test::TemporaryFolder;
using test::workingSet;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr WorldId kWorld{77, 1};

std::vector<ObjectId> idsOf(const Found& found) {
  std::vector<ObjectId> ids;
  for (const auto& object : found.objects) ids.push_back(object.id);
  return ids;
}

class MapQueries : public ::testing::Test {
 protected:
  MapQueries() {
    std::mt19937 random(5);
    // On a coarse grid, so that many centres lie exactly on the limits of the queries.
    std::uniform_int_distribution<int> grid(-40, 40);
    std::vector<ObjectBelief> cars;
    for (ObjectId id = 1; id <= 400; ++id) {
      const Eigen::Vector3d p(0.5 * grid(random), 0.5 * grid(random), 0.1 * grid(random));
      cars.push_back(carAt(id, p, id % 3 == 0 ? "chair" : "car"));
    }
    all_ = workingSet(1, cars);
    EXPECT_TRUE(database_.write({&all_, {}, {}}).has_value());
  }

  Found ask(const MapQuery& query, std::uint32_t limit = 1000) {
    auto found = database_.reader().find(query, kWorld, limit);
    EXPECT_TRUE(found.has_value());
    return *found;
  }

  template <class Predicate>
  std::vector<ObjectId> walk(Predicate matches) const {
    std::vector<ObjectId> ids;
    for (const auto& belief : all_.objects) {
      if (matches(belief)) ids.push_back(belief.id);
    }
    return ids;
  }

  TemporaryFolder folder_;
  MapDatabase database_{{folder_.file("map.sqlite")}};
  Objects all_;
};

TEST_F(MapQueries, FindWithinABoxWhatAWalkFinds) {
  std::mt19937 random(6);
  std::uniform_int_distribution<int> grid(-40, 40);
  std::size_t hits = 0;
  for (int trial = 0; trial < 200; ++trial) {
    MapQuery query;
    query.kind = MapQueryKind::kByBox;
    const Eigen::Vector3d a(0.5 * grid(random), 0.5 * grid(random), 0.1 * grid(random));
    const Eigen::Vector3d b(0.5 * grid(random), 0.5 * grid(random), 0.1 * grid(random));
    query.low = a.cwiseMin(b);
    query.high = a.cwiseMax(b);
    const auto expected = walk([&](const ObjectBelief& belief) {
      const auto p = belief.best().mean.head<3>().array();
      return (p >= query.low.array()).all() && (p <= query.high.array()).all();
    });
    EXPECT_EQ(idsOf(ask(query)), expected);
    hits += expected.size();
  }
  EXPECT_GT(hits, 1000u);
}

TEST_F(MapQueries, FindWithinARadiusWhatAWalkFindsNearestFirst) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> grid(-40, 40);
  for (int trial = 0; trial < 200; ++trial) {
    MapQuery query;
    query.kind = MapQueryKind::kByRadius;
    query.low = {0.5 * grid(random), 0.5 * grid(random), 0.0};
    query.radius = 0.25 * (1 + trial % 40);
    const auto distance = [&](ObjectId id) {
      const Eigen::Vector3d d = all_.objects[id - 1].best().mean.head<3>() - query.low;
      return d.x() * d.x() + d.y() * d.y() + d.z() * d.z();
    };
    auto expected = walk([&](const ObjectBelief& belief) {
      return distance(belief.id) <= query.radius * query.radius;
    });
    std::stable_sort(expected.begin(), expected.end(),
                     [&](ObjectId a, ObjectId b) { return distance(a) < distance(b); });
    EXPECT_EQ(idsOf(ask(query)), expected);
  }
}

TEST_F(MapQueries, FindByIdByClassAndAll) {
  MapQuery query;
  query.kind = MapQueryKind::kById;
  query.object_id = 123;
  EXPECT_THAT(idsOf(ask(query)), ElementsAre(123u));
  query.object_id = 1000;
  EXPECT_THAT(idsOf(ask(query)), IsEmpty());
  query.kind = MapQueryKind::kByClass;
  query.class_name = "chair";
  EXPECT_EQ(idsOf(ask(query)), walk([](const ObjectBelief& b) { return b.id % 3 == 0; }));
  query.kind = MapQueryKind::kAll;
  EXPECT_EQ(ask(query).objects.size(), 400u);
}

TEST_F(MapQueries, SayWhenMoreMatchedThanTheLimit) {
  MapQuery query;
  query.kind = MapQueryKind::kAll;
  EXPECT_TRUE(ask(query, 399).truncated);
  EXPECT_EQ(ask(query, 399).objects.size(), 399u);
  EXPECT_FALSE(ask(query, 400).truncated);
}

TEST_F(MapQueries, LookForPlacesInOneFrameOfReferenceOnly) {
  Objects elsewhere = workingSet(2, {carAt(900, {0, 0, 0})});
  elsewhere.world = {77, 2};
  ASSERT_TRUE(database_.write({&elsewhere, {}, {}}).has_value());
  MapQuery query;
  query.kind = MapQueryKind::kByRadius;
  query.radius = 0.2;
  query.world = {77, 2};
  EXPECT_THAT(idsOf(ask(query)), ElementsAre(900u));
  query.world = kWorld;
  EXPECT_THAT(idsOf(ask(query)), ::testing::Not(::testing::Contains(900u)));
}

TEST_F(MapQueries, CarryTheWholeObject) {
  MapQuery query;
  query.kind = MapQueryKind::kById;
  query.object_id = 9;
  const MapObject object = ask(query).objects.at(0);
  const ObjectBelief& belief = all_.objects[8];
  EXPECT_EQ(object.mean, belief.best().mean);
  EXPECT_EQ(object.covariance, belief.best().covariance);
  EXPECT_EQ(object.world, kWorld);
  EXPECT_EQ(object.class_name, "chair");
  EXPECT_EQ(object.hits, 7u);
  EXPECT_EQ(object.memory, Memory::kWorking);
}

TEST_F(MapQueries, GiveTheWholeBeliefOfAnObjectThatIsAskedForByItsId) {
  MapQuery query;
  query.kind = MapQueryKind::kById;
  query.object_id = 9;
  const auto beliefs = ask(query).beliefs;
  ASSERT_EQ(beliefs.size(), 1u);
  EXPECT_EQ(encodeBelief(beliefs[0]), encodeBelief(all_.objects[8]));
  query.kind = MapQueryKind::kAll;
  EXPECT_THAT(ask(query).beliefs, IsEmpty());
}

TEST_F(MapQueries, ShowObjectsThatLeftTheWorkingSetAsRemembered) {
  const Objects fewer = workingSet(2, {all_.objects[0]});
  ASSERT_TRUE(database_.write({&fewer, {}, {}}).has_value());
  MapQuery query;
  query.kind = MapQueryKind::kById;
  query.object_id = 2;
  EXPECT_EQ(ask(query).objects.at(0).memory, Memory::kLongTerm);
  EXPECT_EQ(ask(query).objects.at(0).visibility, Visibility::kOutOfView);
  query.object_id = 1;
  EXPECT_EQ(ask(query).objects.at(0).memory, Memory::kWorking);
}

TEST_F(MapQueries, ForgetObjectsThatAreGoneAndRefuseTheirLateBeliefs) {
  Objects later = workingSet(3, {});
  const TimePoint gone_at = fromNanoseconds(250'000'000);
  ASSERT_TRUE(database_.write({&later, {}, {{5, {EventKind::kGone, gone_at, 0}}}}).has_value());
  MapQuery query;
  query.kind = MapQueryKind::kById;
  query.object_id = 5;
  EXPECT_THAT(idsOf(ask(query)), IsEmpty());
  const Objects late = workingSet(2, {all_.objects[4]});
  ASSERT_TRUE(database_.write({&late, {}, {}}).has_value());
  EXPECT_THAT(idsOf(ask(query)), IsEmpty());
  EXPECT_TRUE(database_.reader().working().value()->objects.empty());
  const Objects newer = workingSet(4, {all_.objects[4]});
  ASSERT_TRUE(database_.write({&newer, {}, {}}).has_value());
  EXPECT_THAT(idsOf(ask(query)), ElementsAre(5u));
}

TEST_F(MapQueries, TellWhereEachObjectWasStoredAndWhatIsNoLongerThere) {
  Objects later = workingSet(3, {});
  const TimePoint gone_at = fromNanoseconds(250'000'000);
  ASSERT_TRUE(
      database_
          .write({&later,
                  {},
                  {{5, {EventKind::kMerged, gone_at, 9}}, {7, {EventKind::kMerged, gone_at, 9}}}})
          .has_value());
  const auto places = database_.reader().places().value();
  ASSERT_EQ(places.size(), 398u);
  for (const StoredPlace& place : places) {
    const ObjectBelief& belief = all_.objects[place.id - 1];
    EXPECT_EQ(place.p_W, Eigen::Vector3d(belief.best().mean.head<3>()));
    EXPECT_EQ(place.last_seen, belief.last_seen);
    EXPECT_EQ(place.world, kWorld);
  }
  EXPECT_FALSE(database_.reader().placeOf(5).value());
  EXPECT_EQ(database_.reader().placeOf(6).value()->id, 6u);
  EXPECT_THAT(database_.reader().mergedInto(9).value(), ElementsAre(5u, 7u));
  EXPECT_THAT(database_.reader().mergedInto(10).value(), IsEmpty());
}

TEST_F(MapQueries, GiveObjectsByTheirIdsInTheOrderAskedFor) {
  const auto found = database_.reader().byIds({9, 3, 1000, 200}, 5).value();
  EXPECT_THAT(idsOf(found), ElementsAre(9u, 3u, 200u));
  EXPECT_FALSE(found.truncated);
  EXPECT_THAT(idsOf(database_.reader().byIds({9, 3, 200}, 2).value()), ElementsAre(9u, 3u));
  EXPECT_TRUE(database_.reader().byIds({9, 3, 200}, 2).value().truncated);
  EXPECT_FALSE(database_.reader().byIds({9, 3, 1000}, 2).value().truncated);
}

TEST_F(MapQueries, GiveInFullWhatIsNearInTheWorkingSetOrNot) {
  const Objects fewer = workingSet(2, {all_.objects[0]});
  ASSERT_TRUE(database_.write({&fewer, {}, {}}).has_value());
  MapQuery query;
  query.kind = MapQueryKind::kByRadius;
  query.low = all_.objects[0].best().mean.head<3>();
  query.radius = 8.0;
  const auto near = database_.reader().inFullNear(query.low, query.radius, kWorld, 1000).value();
  EXPECT_EQ(idsOf(near), idsOf(ask(query)));
  ASSERT_GT(near.beliefs.size(), 3u);
  bool working = false;
  for (std::size_t k = 0; k < near.beliefs.size(); ++k) {
    EXPECT_EQ(near.beliefs[k].id, near.objects[k].id);
    EXPECT_EQ(near.beliefs[k].best().mean, all_.objects[near.beliefs[k].id - 1].best().mean);
    working = working || near.beliefs[k].id == 1;
  }
  EXPECT_TRUE(working);
  EXPECT_TRUE(database_.reader().inFullNear(query.low, query.radius, kWorld, 2).value().truncated);
  EXPECT_TRUE(
      database_.reader().inFullNear(query.low, query.radius, {77, 2}, 2).value().beliefs.empty());
}

TEST_F(MapQueries, GiveTheBeliefOfATrackWithItsWorldUntilItIsGone) {
  const auto placed = database_.reader().beliefOf(9).value();
  ASSERT_TRUE(placed);
  EXPECT_EQ(placed->world, kWorld);
  EXPECT_EQ(encodeBelief(placed->belief), encodeBelief(all_.objects[8]));
  EXPECT_FALSE(database_.reader().beliefOf(1000).value());
  Objects later = workingSet(3, {});
  const Removal gone{EventKind::kGone, fromNanoseconds(250'000'000), 0};
  ASSERT_TRUE(database_.write({&later, {}, {{9, gone}}}).has_value());
  EXPECT_FALSE(database_.reader().beliefOf(9).value());
}

TEST_F(MapQueries, AWriteSaysWhichObjectsItChanged) {
  Objects next = all_;
  next.stamp.sequence = 2;
  next.objects[3].hits = 99;
  next.objects.erase(next.objects.begin() + 10);
  const auto written = database_.write({&next, {}, {}}).value();
  EXPECT_THAT(written.objects, ElementsAre(4u, 11u));
  EXPECT_THAT(database_.write({&next, {}, {}}).value().objects, IsEmpty());
}

}  // namespace
}  // namespace perdure::map_store
