// Tests that each scene shows what its description states.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/camera/camera_model.h"
#include "common/math/so3.h"
#include "common/sim/scene.h"
#include "common/sim/solid.h"

namespace perdure::sim {
namespace {

constexpr std::uint64_t kSeeds[] = {1, 2, 3, 7};

RigidTransform cameraPose(const Scene& scene, double t) {
  return scene.body.poseAt(t) * scene.rig.calibration.cameras[0].T_BC;
}

std::vector<const SceneObject*> ofClass(const Scene& scene, const std::string& name) {
  std::vector<const SceneObject*> found;
  for (const SceneObject& object : scene.objects) {
    if (object.class_name == name) found.push_back(&object);
  }
  return found;
}

/// Returns the angle between the optical axis and the direction of the object's centre, in radians.
double offAxis(const Scene& scene, const SceneObject& object, double t) {
  const RigidTransform T_WC = cameraPose(scene, t);
  const Eigen::Vector3d way = (object.motion.poseAt(t).p - T_WC.p).normalized();
  return std::acos(way.dot(T_WC.R().col(2)));
}

struct Span {
  double width = 0.0, height = 0.0;
};

/// Returns the extent of the object's corners in the image, or nothing if a corner is outside.
std::optional<Span> spanOf(const Scene& scene, const SceneObject& object, double t) {
  const CameraModel camera(scene.rig.calibration.cameras[0]);
  const RigidTransform T_CO = cameraPose(scene, t).inverse() * object.motion.poseAt(t);
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
    const auto pixel = camera.project(T_CO * corner.cwiseProduct(object.size));
    if (!pixel || !camera.inImage(*pixel)) return std::nullopt;
    low = low.cwiseMin(*pixel);
    high = high.cwiseMax(*pixel);
  }
  return Span{high.x() - low.x(), high.y() - low.y()};
}

/// Returns all other objects as boxes. A table is only its top, because the space below it is open.
std::vector<Solid> othersThan(const Scene& scene, const SceneObject& object, double t) {
  std::vector<Solid> others;
  for (const Prop& prop : scene.props) {
    for (const Solid& solid : solidsOf(prop)) others.push_back(solid);
  }
  for (const SceneObject& other : scene.objects) {
    if (other.id == object.id || !other.presentAt(t)) continue;
    Solid solid = solidOf(other, t);
    if (other.class_name == "dining table") solid.low = solid.high - 0.03;
    others.push_back(solid);
  }
  return others;
}

bool sees(const std::vector<Solid>& others, const Eigen::Vector3d& eye,
          const Eigen::Vector3d& target) {
  return std::none_of(others.begin(), others.end(),
                      [&](const Solid& solid) { return blocks(solid, eye, target); });
}

/// Returns the share of a grid of points of the object's box that no other box hides.
double shareSeen(const Scene& scene, const SceneObject& object, double t) {
  const Eigen::Vector3d eye = cameraPose(scene, t).p;
  const std::vector<Solid> others = othersThan(scene, object, t);
  const RigidTransform T_WO = object.motion.poseAt(t);
  int seen = 0, all = 0;
  for (double x = -0.45; x < 0.5; x += 0.3) {
    for (double y = -0.45; y < 0.5; y += 0.15) {
      for (double z = -0.45; z < 0.5; z += 0.15) {
        seen += sees(others, eye, T_WO * Eigen::Vector3d(x, y, z).cwiseProduct(object.size));
        ++all;
      }
    }
  }
  return static_cast<double>(seen) / all;
}

TEST(Street, ComesByASecondTimeWithinAMinute) {
  for (const auto seed : kSeeds) {
    const Scene scene = makeScene("street", seed, {});
    EXPECT_EQ(scene.seconds, 60.0);
    double driven = 0.0;
    for (double t = 0.0; t < 60.0; t += 0.01) driven += 0.01 * scene.body.at(t).velocity_W.norm();
    EXPECT_GT(driven / 60.0, 6.0);
    EXPECT_LT(driven / 60.0, 9.0);
    const RigidTransform first = scene.body.poseAt(8.0);
    double nearest = 1e9;
    for (double t = 20.0; t < 60.0; t += 0.01) {
      const RigidTransform now = scene.body.poseAt(t);
      if (std::abs(wrapAngle(yawOf(now.R()) - yawOf(first.R()))) > 0.1) continue;
      nearest = std::min(nearest, (now.p - first.p).norm());
    }
    EXPECT_LT(nearest, 0.2) << seed;
  }
}

TEST(Lap, EndsAtRestWhereItBegan) {
  for (const auto seed : kSeeds) {
    const Scene scene = makeScene("lap", seed, {});
    const MotionState first = scene.body.at(0.0), last = scene.body.at(scene.seconds);
    EXPECT_LT((first.T_WB.p - last.T_WB.p).norm(), 1e-6) << seed;
    EXPECT_LT(first.T_WB.q.angularDistance(last.T_WB.q), 1e-6) << seed;
    for (const double t : {0.0, 0.5, scene.seconds - 0.5, scene.seconds}) {
      EXPECT_LT(scene.body.at(t).velocity_W.norm(), 1e-6) << seed << " at " << t;
    }
    double driven = 0.0;
    for (double t = 0.0; t < scene.seconds; t += 0.01)
      driven += 0.01 * scene.body.at(t).velocity_W.norm();
    EXPECT_GT(driven, 150.0) << seed;
  }
}

TEST(Street, HasThingsOfAllItsClassesOnBothSides) {
  const Scene scene = makeScene("street", 7, {});
  EXPECT_GT(ofClass(scene, "car").size(), 40u);
  EXPECT_GT(ofClass(scene, "van").size(), 5u);
  EXPECT_GT(ofClass(scene, "person").size(), 10u);
  EXPECT_GT(ofClass(scene, "bicycle").size(), 10u);
  std::map<PropKind, int> props;
  for (const Prop& prop : scene.props) ++props[prop.kind];
  for (const auto kind : {PropKind::kFacade, PropKind::kTree, PropKind::kPole, PropKind::kHedge}) {
    EXPECT_GT(props[kind], 5) << static_cast<int>(kind);
  }
}

TEST(Room, HasFurnitureOfAllItsClasses) {
  for (const auto seed : kSeeds) {
    const Scene scene = makeScene("room", seed, {});
    EXPECT_GT(ofClass(scene, "chair").size(), 4u);
    EXPECT_GT(ofClass(scene, "dining table").size(), 1u);
    EXPECT_GT(ofClass(scene, "monitor").size(), 2u);
    EXPECT_GT(ofClass(scene, "couch").size(), 0u);
  }
}

TEST(Toy, FillsThePixelsOfACarAndIsLargerInTheImageThanTwoOthers) {
  for (const char* name : {"toy", "still"}) {
    for (const auto seed : kSeeds) {
      const Scene scene = makeScene(name, seed, {});
      const auto toys = ofClass(scene, "toy"), cars = ofClass(scene, "car");
      ASSERT_EQ(toys.size(), 1u);
      ASSERT_EQ(cars.size(), 3u);
      EXPECT_EQ(toys[0]->looks_like, "car");
      EXPECT_NEAR(toys[0]->size.x(), 0.3, 1e-9);
      EXPECT_NEAR(cars[0]->size.x(), 4.2, 1e-9);
      const auto toy = spanOf(scene, *toys[0], 0.5), car = spanOf(scene, *cars[0], 0.5);
      ASSERT_TRUE(toy && car);
      EXPECT_NEAR(toy->width / car->width, 1.0, 0.1);
      EXPECT_NEAR(toy->height / car->height, 1.0, 0.1);
      for (std::size_t i : {1u, 2u}) {
        const auto far = spanOf(scene, *cars[i], 0.5);
        ASSERT_TRUE(far);
        EXPECT_LT(far->height, 0.8 * toy->height);
        EXPECT_GT(far->height, 12.0);
      }
      for (const SceneObject* object : {toys[0], cars[0], cars[1], cars[2]}) {
        EXPECT_GT(shareSeen(scene, *object, 0.5), 0.3) << name << " " << object->id;
      }
    }
  }
}

TEST(Toy, IsSeenFromPlacesThatAreFarEnoughApart) {
  const Scene scene = makeScene("toy", 7, {});
  const Eigen::Vector3d toy = ofClass(scene, "toy")[0]->motion.poseAt(0).p;
  double widest = 0.0;
  for (double t = 0.0; t < scene.seconds; t += 0.1) {
    widest = std::max(widest, (scene.body.poseAt(t).p - scene.body.poseAt(0).p).norm());
    EXPECT_LT(offAxis(scene, *ofClass(scene, "toy")[0], t), 0.65) << t;
  }
  EXPECT_GT(widest, 0.3 * (toy - scene.body.poseAt(0).p).norm());
}

TEST(Still, DoesNotMoveAtAll) {
  const Scene scene = makeScene("still", 7, {});
  for (double t = 0.0; t < scene.seconds; t += 0.5) {
    EXPECT_EQ(boxMinus(scene.body.poseAt(t), scene.body.poseAt(0)).norm(), 0.0);
  }
}

TEST(Occlusion, HidesTheChairBehindTheMonitorAndShowsItAgain) {
  for (const auto seed : kSeeds) {
    const Scene scene = makeScene("occlusion", seed, {});
    const SceneObject& chair = *ofClass(scene, "chair")[0];
    for (const double t : {2.0, 5.0, 7.0, 17.5, 20.0, 30.5}) {
      EXPECT_GT(shareSeen(scene, chair, t), 0.5) << t;
      EXPECT_LT(offAxis(scene, chair, t), 0.55) << t;
    }
    for (double t = 10.0; t < 13.3; t += 0.1) EXPECT_LT(shareSeen(scene, chair, t), 0.02) << t;
    for (double t = 23.5; t < 25.8; t += 0.1) EXPECT_LT(shareSeen(scene, chair, t), 0.02) << t;
  }
}

TEST(Vanish, ChangesWhatIsBehindOnesBackAndLooksAgain) {
  for (const auto seed : kSeeds) {
    const Scene scene = makeScene("vanish", seed, {});
    int gone = 0, moved = 0;
    for (const SceneObject& object : scene.objects) {
      const bool goes = object.present_until_s < scene.seconds;
      gone += goes, moved += object.steps;
      if (!goes && !object.steps) continue;
      const double changes = object.steps ? 12.4 : object.present_until_s;
      for (double t = changes - 1.5; t < changes + 1.5; t += 0.1) {
        EXPECT_GT(offAxis(scene, object, t), 1.0) << t;  // the image extends to 0.87
      }
      for (const double t : {2.0, 5.0, 21.0, 24.0}) EXPECT_LT(offAxis(scene, object, t), 0.65) << t;
      EXPECT_GT(shareSeen(scene, object, 4.0), 0.5);
      if (object.steps) {
        const Eigen::Vector3d way = object.motion.poseAt(13.0).p - object.motion.poseAt(12.0).p;
        EXPECT_GT(way.norm(), 1.0);
        EXPECT_GT(shareSeen(scene, object, 22.0), 0.5);
      }
    }
    EXPECT_EQ(gone, 1);
    EXPECT_EQ(moved, 1);
  }
}

TEST(Row, IsOfTenCarsWithEightyCentimetresBetween) {
  for (const auto seed : kSeeds) {
    const Scene scene = makeScene("row", seed, {});
    const auto cars = ofClass(scene, "car");
    ASSERT_EQ(cars.size(), 10u);
    EXPECT_TRUE(ofClass(scene, "van").empty());
    for (std::size_t i = 0; i + 1 < cars.size(); ++i) {
      const Solid a = solidOf(*cars[i], 0), b = solidOf(*cars[i + 1], 0);
      EXPECT_NEAR(b.centre.x() - b.half.x() - a.centre.x() - a.half.x(), 0.8, 1e-9);
    }
    EXPECT_GT(scene.body.poseAt(scene.seconds).p.x(), cars.back()->motion.poseAt(0).p.x());
  }
}

TEST(Roll, LeansBySixtyDegreesToBothSides) {
  const Scene scene = makeScene("roll", 7, {});
  double least = 0.0, most = 0.0;
  for (double t = 0.0; t < scene.seconds; t += 0.05) {
    const Eigen::Matrix3d R = scene.body.poseAt(t).R();
    const double roll = std::atan2(R(2, 1), R(2, 2)) * 180.0 / M_PI;
    least = std::min(least, roll), most = std::max(most, roll);
  }
  EXPECT_NEAR(most, 60.0, 2.0);
  EXPECT_NEAR(least, -60.0, 2.0);
}

TEST(Straight, IsDrivenEvenlyForAMinute) {
  const Scene scene = makeScene("straight", 7, {});
  const double speed = scene.body.at(12.0).velocity_W.norm();
  EXPECT_GT(speed, 6.0);
  for (double t = 10.0; t < 60.0; t += 0.1) {
    const MotionState state = scene.body.at(t);
    EXPECT_NEAR(state.velocity_W.x(), speed, 0.01) << t;
    EXPECT_NEAR(state.velocity_W.y(), 0.0, 1e-6);
    EXPECT_NEAR(yawOf(state.T_WB.R()), 0.0, 0.01);
  }
}

TEST(Traffic, HasCarsThatPassCrossDriveOffAndArrive) {
  for (const auto seed : kSeeds) {
    const Scene scene = makeScene("traffic", seed, {});
    int moving = 0, towards = 0, across = 0, off = 0, out = 0, arrived = 0, walkers = 0;
    for (const SceneObject& object : scene.objects) {
      if (!object.moves) continue;
      ++moving;
      const MotionState early = object.motion.at(0.5), middle = object.motion.at(12.0);
      const MotionState late = object.motion.at(38.0);
      towards += early.velocity_W.x() < -6.0 && late.velocity_W.x() < -6.0;
      across += std::abs(middle.velocity_W.y()) > 6.0;
      off += early.velocity_W.norm() < 1e-6 && late.velocity_W.x() < -5.0;
      out += early.velocity_W.norm() < 1e-6 && late.velocity_W.x() > 5.0;
      arrived += early.velocity_W.norm() > 3.0 && late.velocity_W.norm() < 1e-3;
      walkers += object.class_name == "person";
      // The camera points in the direction of motion.
      if (middle.velocity_W.norm() > 1.0) {
        EXPECT_GT(middle.velocity_W.normalized().dot(middle.T_WB.R().col(0)), 0.99) << object.id;
      }
    }
    EXPECT_GE(moving, 9);
    EXPECT_GE(towards, 3);
    EXPECT_EQ(across, 1);
    EXPECT_EQ(off, 1) << seed;
    EXPECT_GE(out, 1) << seed;
    EXPECT_EQ(arrived, 1) << seed;
    EXPECT_EQ(walkers, 2);
    EXPECT_GT(ofClass(scene, "car").size(), 40u);
  }
}

TEST(Town, HasFourKilometresAndFiveHundredVehicles) {
  const Scene scene = makeScene("town", 7, {});
  double length = 0.0, driven = 0.0;
  for (const Road& road : scene.roads) length += (road.to - road.from).norm();
  EXPECT_NEAR(length, 4000.0, 150.0);
  EXPECT_EQ(ofClass(scene, "car").size() + ofClass(scene, "van").size(), 500u);
  for (double t = 0.0; t < scene.seconds; t += 0.05) {
    driven += 0.05 * scene.body.at(t).velocity_W.norm();
  }
  EXPECT_GT(driven, 4000.0);
}

/// Smallest and largest visible share of a standing car, over the body's poses from which its
/// centre is 6 to 25 m away and within 35° of the optical axis.
std::pair<double, double> sharesSeen(const Scene& scene, const SceneObject& car) {
  double least = 1.0, most = 0.0;
  for (double t = 0.0; t < scene.seconds; t += 1.0) {
    const double away = (car.motion.poseAt(t).p - cameraPose(scene, t).p).norm();
    if (away < 6.0 || away > 25.0 || offAxis(scene, car, t) > 0.6) continue;
    const double share = shareSeen(scene, car, t);
    least = std::min(least, share), most = std::max(most, share);
  }
  return {least, most};
}

TEST(Suburb, HidesACarFromOneDirectionAndShowsItFromAnother) {
  for (const std::uint64_t seed : {1, 7}) {
    const Scene scene = makeScene("suburb", seed, {});
    Scene scenery = scene;
    scenery.objects.clear();
    int seen = 0, one_sided = 0;
    for (const SceneObject* car : ofClass(scene, "car")) {
      if (car->moves) continue;
      const auto [least, most] = sharesSeen(scenery, *car);
      seen += most > 0.8;
      one_sided += least < 0.25 && most > 0.8;
    }
    EXPECT_GT(one_sided, seen / 12) << seed;
  }
}

TEST(Suburb, HasAFewOncomingCarsAmongStandingOnes) {
  for (const auto seed : kSeeds) {
    const Scene scene = makeScene("suburb", seed, {});
    double moving = 0, vehicles = 0, nearest = 1e9;
    for (const SceneObject& object : scene.objects) {
      vehicles += object.class_name == "car" || object.class_name == "van";
      if (!object.moves) continue;
      ++moving;
      nearest = 1e9;
      for (double t = object.present_from_s; t < object.present_until_s; t += 0.05) {
        nearest = std::min(nearest, (object.motion.poseAt(t).p - cameraPose(scene, t).p).norm());
      }
      EXPECT_LT(nearest, 4.0) << "the car and the body pass each other";
    }
    EXPECT_NEAR(moving / vehicles, 0.02, 0.006) << seed;
    EXPECT_GT(vehicles, 180) << seed;
  }
}

/// The contents of one block of the scene of blocks, relative to its south-west crossing.
struct BlockContents {
  std::vector<const SceneObject*> objects;
  std::vector<RigidTransform> places;
};

std::map<std::pair<int, int>, BlockContents> contentsOfBlocks(const Scene& scene) {
  constexpr double kPitchX = 52.0, kPitchY = 46.0;
  std::map<std::pair<int, int>, BlockContents> blocks;
  for (const SceneObject& object : scene.objects) {
    RigidTransform T = object.motion.poseAt(0);
    const std::pair block(static_cast<int>(std::floor(T.p.x() / kPitchX)),
                          static_cast<int>(std::floor(T.p.y() / kPitchY)));
    T.p -= Eigen::Vector3d(kPitchX * block.first, kPitchY * block.second, 0);
    blocks[block].objects.push_back(&object);
    blocks[block].places.push_back(T);
  }
  return blocks;
}

/// Returns how many objects of `a` have no counterpart of equal class and size at the same place in
/// `b`.
std::size_t missingIn(const BlockContents& a, const BlockContents& b) {
  std::size_t missing = 0;
  for (std::size_t i = 0; i < a.objects.size(); ++i) {
    bool found = false;
    for (std::size_t k = 0; k < b.objects.size() && !found; ++k) {
      found = a.objects[i]->class_name == b.objects[k]->class_name &&
              a.objects[i]->size == b.objects[k]->size &&
              boxMinus(a.places[i], b.places[k]).norm() < 1e-6;
    }
    missing += found ? 0 : 1;
  }
  return missing;
}

TEST(Blocks, AreEqualButForAFewThingsAndInAMinorityForMany) {
  for (const auto seed : kSeeds) {
    const Scene scene = makeScene("blocks", seed, {});
    const auto blocks = contentsOfBlocks(scene);
    ASSERT_EQ(blocks.size(), 56u);
    // The design: the block that equals most others.
    std::size_t equal = 0, few = 0, many = 0;
    const BlockContents* design = nullptr;
    for (const auto& [at, block] : blocks) {
      std::size_t like = 0;
      for (const auto& [other_at, other] : blocks)
        like += missingIn(block, other) + missingIn(other, block) == 0;
      if (like > equal) equal = like, design = &block;
    }
    std::size_t vehicles = 0;
    for (const SceneObject* object : design->objects)
      vehicles += object->class_name == "car" || object->class_name == "van";
    EXPECT_GE(vehicles, 6u) << seed;
    for (const auto& [at, block] : blocks) {
      const std::size_t differ = missingIn(block, *design) + missingIn(*design, block);
      few += differ == 1 || differ == 2;
      many += differ >= 5;
    }
    EXPECT_GE(equal, 20u) << seed;
    EXPECT_GE(few, 24u) << seed;
    EXPECT_GE(many, 6u) << seed;
    EXPECT_LE(many, 8u) << seed;
  }
}

TEST(Blocks, AreLongOutOfSightAndThenSeenAgainFromBothDirections) {
  for (const auto seed : kSeeds) {
    const Scene scene = makeScene("blocks", seed, {});
    std::vector<RigidTransform> way;  // one pose per second
    double driven = 0.0;
    for (double t = 0.0; t < scene.seconds; t += 1.0) {
      way.push_back(scene.body.poseAt(t));
      if (way.size() > 1) driven += (way.back().p - way[way.size() - 2].p).norm();
    }
    EXPECT_GT(driven, 2500.0) << seed;
    EXPECT_LT(driven, 4000.0) << seed;
    EXPECT_LT(scene.body.at(scene.seconds - 1.0).velocity_W.norm(), 0.1) << "it has arrived";
    std::size_t same = 0, against = 0, across = 0;
    for (std::size_t i = 0; i < way.size(); ++i) {
      bool was_same = false, was_against = false, was_across = false;
      for (std::size_t k = 0; k + 60 < i; ++k) {
        if ((way[i].p - way[k].p).norm() > 8.0) continue;
        const double turn = std::abs(wrapAngle(yawOf(way[i].R()) - yawOf(way[k].R())));
        was_same |= turn < 0.3;
        was_against |= turn > M_PI - 0.3;
        was_across |= std::abs(turn - M_PI_2) < 0.3;
      }
      same += was_same, against += was_against, across += was_across;
    }
    EXPECT_GT(same, 25u) << seed;
    EXPECT_GT(against, 25u) << seed;
    EXPECT_GE(across, 6u) << seed;
  }
}

TEST(Random, ShowsAllClassesAtAllSizesUpright) {
  SceneOptions options;
  options.width = 320, options.height = 240;
  options.look_set = "train";
  std::map<std::string, std::array<int, 3>> sizes;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    const Scene scene = makeScene("random", seed, options);
    for (double t = 0.0; t < scene.seconds; t += 1.0) {
      // Objects are seen in motion, not during the jump to the next view.
      EXPECT_LT(scene.body.at(t).velocity_W.norm(), 7.5);
      for (const SceneObject& object : scene.objects) {
        const auto span = spanOf(scene, object, t);
        if (!span) continue;
        const double side = std::max(span->width, span->height);
        const Eigen::Vector3d eye = cameraPose(scene, t).p, centre = object.motion.poseAt(t).p;
        if (side < 10 || !sees(othersThan(scene, object, t), eye, centre)) continue;
        ++sizes[object.class_name][side < 30 ? 0 : side < 80 ? 1 : 2];
      }
    }
  }
  ASSERT_EQ(sizes.size(), 8u);
  for (const auto& [name, counts] : sizes) {
    EXPECT_GT(counts[0], name == "couch" || name == "dining table" ? 0 : 15) << name;
    EXPECT_GT(counts[1], 50) << name;
    EXPECT_GT(counts[2], 20) << name;
  }
}

}  // namespace
}  // namespace perdure::sim
