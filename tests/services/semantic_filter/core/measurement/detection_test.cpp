#include "services/semantic_filter/core/measurement/detection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <vector>

#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeCamera;
using testing::makeState;

TEST(BoxStyles, MoveTheBoxByTheInsetsAndUseTheirMeanForOtherClasses) {
  ModelInfo info = testing::makeModelInfo();
  info.side_insets = {0.1, 0.0, 0.1, 0.2, 0, 0, 0, 0, 0, 0, 0, 0, 0.02, 0.04, 0.06, 0.08};
  const Model model = makeModel(info);
  const CameraModel camera{makeCamera()};
  const View view{&camera, RigidTransform(), Eigen::Vector3d::UnitZ()};
  const State x = makeState(20, 1, 0, 0.4, 4, 2, 1.5);
  const auto whole = projectCuboid(x, view);
  const auto car = projectObserved(x, view, model.styles->of("car"));
  ASSERT_TRUE(whole && car);
  const double w = whole->sides[2] - whole->sides[0], h = whole->sides[3] - whole->sides[1];
  EXPECT_TRUE(car->sides.isApprox(whole->sides + Eigen::Vector4d(0.1 * w, 0, -0.1 * w, -0.2 * h)));
  EXPECT_TRUE(
      model.styles->of(kOtherClass).offset.isApprox(Eigen::Vector4d(0.03, 0.01, -0.04, -0.07)));
  EXPECT_TRUE(makeModel(testing::makeModelInfo()).styles->of("car").offset.isZero());
}

TEST(BoxStyles, TakeTheShapesOfThePriorsIfTheBoxesEncloseOutlines) {
  ClassPriors priors;
  priors.classes = {ClassPrior{.name = "car"}, ClassPrior{.name = "unicorn"}};
  priors.classes[0].shape = shapeOf({{-1, 0.5, 0.5, 1}, {1, 1, 1, 0.5}});
  ModelInfo info = testing::makeModelInfo();
  EXPECT_TRUE(makeModel(info, priors).styles->of("car").shape.is_cuboid);
  info.boxes = BoxExtent::kOutline;
  info.side_insets.assign(4 * info.classes.size(), 0.02);
  const Model model = makeModel(info, priors);
  EXPECT_EQ(model.styles->of("car").shape.corners(), 12);
  EXPECT_DOUBLE_EQ(model.styles->of("car").offset[0], 0.02);
  EXPECT_TRUE(model.styles->of("unicorn").shape.is_cuboid);
  EXPECT_DOUBLE_EQ(model.styles->of("unicorn").offset[3], -0.02)
      << "of a class that the network does not know: the mean";
  EXPECT_TRUE(model.styles->of(kOtherClass).shape.is_cuboid);
}

TEST(BoxStyles, AreThoseOfBothExtentsIfTheModelDoesNotSayIt) {
  ClassPriors priors;
  priors.classes = {ClassPrior{.name = "car"}};
  priors.classes[0].shape = shapeOf({{-1, 0.5, 0.5, 1}, {1, 1, 1, 0.5}});
  ModelInfo info = testing::makeModelInfo();
  EXPECT_FALSE(makeModel(info, priors).outline_styles);
  info.boxes = BoxExtent::kUnknown;
  const Model model = makeModel(info, priors);
  EXPECT_TRUE(model.styles->of("car").shape.is_cuboid);
  ASSERT_TRUE(model.outline_styles);
  EXPECT_EQ(model.outline_styles->of("car").shape.corners(), 12);
  info.side_insets.assign(4 * info.classes.size(), 0.02);
  EXPECT_FALSE(makeModel(info, priors).outline_styles) << "the insets are those of cuboids";
}

using Sides = std::array<bool, 4>;

constexpr Sides kNone{};

/// Boxes with sides at these pixels, in an image of a camera that is rolled to the left by `lean`,
/// rad.
std::vector<BoxDetection> boxesAt(std::initializer_list<Eigen::Vector4d> sides, double lean = 0.0) {
  const CameraModel camera{makeCamera()};
  const Eigen::Quaterniond leaning(Eigen::AngleAxisd(-lean, Eigen::Vector3d::UnitX()));
  const View view{&camera, RigidTransform(leaning, Eigen::Vector3d::Zero()),
                  Eigen::Vector3d::UnitZ()};
  std::vector<BoxDetection> boxes(sides.size());
  std::transform(sides.begin(), sides.end(), boxes.begin(), [](const Eigen::Vector4d& s) {
    BoxDetection box;
    box.z = measure({s[0], s[1], s[2], s[3]}, 1242, 375, {});
    return box;
  });
  markSidesBesideNearer(boxes, view);
  return boxes;
}

TEST(SidesBesideNearer, AreWhereABoxThatReachesLowerBegins) {
  const auto boxes = boxesAt({{200, 100, 260, 150}, {262, 90, 380, 190}, {90, 90, 199, 190}});
  EXPECT_EQ(boxes[0].beside_nearer, (Sides{true, false, true, false}));
  EXPECT_EQ(boxes[1].beside_nearer, kNone);
  EXPECT_EQ(boxes[2].beside_nearer, kNone);
}

TEST(SidesBesideNearer, AreTheLowerOneWhereANearerBoxCoversTheFoot) {
  const auto boxes = boxesAt({{200, 100, 260, 150}, {180, 151, 280, 250}});
  EXPECT_EQ(boxes[0].beside_nearer, (Sides{false, false, false, true}));
}

TEST(SidesBesideNearer, AreNotThoseWithinTheNearerBox) {
  const auto boxes = boxesAt({{200, 100, 300, 150}, {262, 90, 380, 190}});
  EXPECT_EQ(boxes[0].beside_nearer, kNone) << "the network has drawn the whole object";
}

TEST(SidesBesideNearer, AreNoneOfBoxesThatReachEquallyLow) {
  const auto boxes = boxesAt({{200, 100, 260, 150}, {261, 100, 320, 151}});
  EXPECT_EQ(boxes[0].beside_nearer, kNone);
  EXPECT_EQ(boxes[1].beside_nearer, kNone);
}

TEST(SidesBesideNearer, AreToldByGravityWhereTheCameraLeans) {
  const std::initializer_list<Eigen::Vector4d> row{{200, 100, 260, 150}, {262, 90, 380, 190}};
  EXPECT_TRUE(boxesAt(row, 0.1)[0].beside_nearer[2]);
  EXPECT_TRUE(boxesAt(row, -0.1)[0].beside_nearer[2]);
  EXPECT_EQ(boxesAt(row, 0.5)[0].beside_nearer, kNone) << "which one stands lower is not known";
  EXPECT_EQ(boxesAt(row, 3.1)[0].beside_nearer, kNone) << "upside down";
}

TEST(SidesBesideNearer, AreNotWhereTheNearerBoxCoversLessThanHalfOfTheSide) {
  const auto boxes = boxesAt({{200, 100, 260, 180}, {262, 150, 380, 250}});
  EXPECT_EQ(boxes[0].beside_nearer, kNone);
}

TEST(SidesBesideNearer, AreNotAtTheBorderWhichCensorsThem) {
  const auto boxes = boxesAt({{0, 100, 60, 150}, {-40, 90, 1, 190}});
  EXPECT_EQ(boxes[0].beside_nearer, kNone);
}

}  // namespace
}  // namespace perdure::semantic_filter
