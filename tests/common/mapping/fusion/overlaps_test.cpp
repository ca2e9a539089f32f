#include "common/mapping/fusion/overlaps.h"

#include <gtest/gtest.h>

#include "common/mapping/map_state.h"
#include "tests/common/mapping/fusion/drives.h"

namespace perdure::mapping {
namespace {

class Overlap : public ::testing::Test {
 protected:
  /// Adds an object of the same class at this distance along and across.
  ObjectId copy(ObjectId of, double along_m, double across_m) {
    const ObjectId id = map_.largestId() + 1;
    map_.objects[id] = map_.objects.at(of);
    map_.objects[id].belief.id = id;
    ObjectRecord record = map_.graph.records.at(of);
    PlacedObject& there = record.sighting.in_anchor;
    there.id = id;
    there.p = LevelPose{there.p, there.yaw} * Eigen::Vector3d(along_m, across_m, 0.0);
    map_.graph.records[id] = record;
    return id;
  }

  std::vector<MergeOrder> orders() const {
    return overlapping(map_, map_.graph, MapState(Parameters(), map_.graph).graph());
  }

  /// The first object that is a car of 4.5 by 1.8 m with a small covariance.
  ObjectId car() {
    for (auto& [id, object] : map_.objects) {
      if (object.belief.best().name != "car" || !map_.graph.records.contains(id)) continue;
      for (ClassBelief& c : object.belief.classes) {
        c.mean.tail<3>() << std::log(4.5), std::log(1.8), std::log(1.5);
      }
      return id;
    }
    return 0;
  }

  MapContents map_ = test::mapOfAShortDrive();
  ObjectId car_ = car();
};

TEST_F(Overlap, OfTwoOfOneClassIsOneObject) {
  ASSERT_TRUE(orders().empty()) << "things of the block stand apart";
  const ObjectId other = copy(car_, 1.5, 0.5);
  ASSERT_EQ(orders().size(), 1u);
  EXPECT_EQ(orders().front().survivor, car_);
  EXPECT_EQ(orders().front().absorbed, other);
}

TEST_F(Overlap, EndsWhereOneCentreLiesOutsideTheOther) {
  copy(car_, 0.0, 1.0);
  EXPECT_TRUE(orders().empty());
}

TEST_F(Overlap, IsOfOneClassOnly) {
  const ObjectId other = copy(car_, 0.5, 0.3);
  for (ClassBelief& c : map_.objects.at(other).belief.classes) c.name += " that is none";
  EXPECT_TRUE(orders().empty());
}

TEST_F(Overlap, SaysNothingOfWhatIsKnownWorseThanItsWidth) {
  const ObjectId other = copy(car_, 0.5, 0.3);
  map_.graph.records.at(other).sighting.in_anchor.covariance += 4.0 * Eigen::Matrix4d::Identity();
  EXPECT_TRUE(orders().empty());
}

TEST_F(Overlap, OfThreeIsLeftAsItIs) {
  copy(car_, 0.5, 0.3);
  copy(car_, -0.5, -0.3);
  EXPECT_TRUE(orders().empty()) << "which two are one?";
}

TEST_F(Overlap, WithWhatHasGoneIsNone) {
  const ObjectId other = copy(car_, 0.5, 0.3);
  map_.objects.at(other).ended = Ending{};
  EXPECT_TRUE(orders().empty());
}

}  // namespace
}  // namespace perdure::mapping
