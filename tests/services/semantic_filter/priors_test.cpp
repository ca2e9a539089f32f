#include "services/semantic_filter/priors.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cstdlib>

#include "common/base/errors.h"
#include "common/math/chi2.h"
#include "common/types/objects.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {
namespace {

std::string sourceFolder() {
  const char* source = std::getenv("PERDURE_SOURCE");
  return source ? source : ".";
}

TEST(ClassPriors, TheShippedFileLoadsAndIsMetric) {
  const ClassPriors priors = loadClassPriors(sourceFolder() + "/config/class_priors.yaml");
  const ClassPrior car = priors.of("car");
  EXPECT_NEAR(std::exp(car.log_size[0]), 4.0, 0.5);
  EXPECT_GT(car.log_size_covariance(0, 1), 0.0);
  EXPECT_EQ(priors.of(kOtherClass).name, kOtherClass);
  for (const auto& p : priors.classes) {
    const double longest = std::exp(p.log_size.maxCoeff());
    EXPECT_TRUE(longest > 0.03 && longest < 60.0) << p.name;
    EXPECT_GT(p.log_size_covariance.determinant(), 0.0) << p.name;
  }
}

TEST(ClassPriors, AClassThatIsNotListedIsTheFallback) {
  const ClassPriors priors = loadClassPriors(sourceFolder() + "/config/class_priors.yaml");
  const ClassPrior& p = priors.of("zebra crossing");
  EXPECT_EQ(p.name, "");
  EXPECT_EQ(p.log_size, priors.fallback.log_size);
}

TEST(ClassPriors, DarknetsNamesHaveThePriorsOfCocos) {
  const ClassPriors priors = loadClassPriors(sourceFolder() + "/config/class_priors.yaml");
  for (const auto& [darknet, coco] : {std::pair("tvmonitor", "tv"),
                                      {"diningtable", "dining table"},
                                      {"pottedplant", "potted plant"},
                                      {"motorbike", "motorcycle"},
                                      {"aeroplane", "airplane"},
                                      {"sofa", "couch"}}) {
    EXPECT_EQ(priors.of(darknet).name, darknet);
    EXPECT_EQ(priors.of(darknet).log_size, priors.of(coco).log_size) << darknet;
  }
}

TEST(ClassPriors, NamesEveryMistakeWithItsPlace) {
  const std::string yaml =
      "fallback: {size: [1, 1, 1], spread: [0.3, 0.3, 0.3]}\n"
      "other: {}\n"
      "classes:\n"
      "  Car: {size: [4, 2]}\n"
      "  van: {siz: [4, 2, 2], detection: 1.5}\n";
  try {
    parseClassPriors(yaml, "priors.yaml");
    FAIL() << "accepted";
  } catch (const StartupError& e) {
    const std::string text = e.what();
    EXPECT_EQ(e.code(), ExitCode::kConfiguration);
    EXPECT_NE(text.find("priors.yaml:4:3: Car: names are lower-case"), std::string::npos) << text;
    EXPECT_NE(text.find("priors.yaml:4:15: size: write three numbers"), std::string::npos) << text;
    EXPECT_NE(text.find("priors.yaml:5:9: siz: unknown"), std::string::npos) << text;
    EXPECT_NE(text.find("detection: is not a number from 0.01 to 0.99"), std::string::npos) << text;
  }
}

TEST(ClassPriors, EveryKindOfTrafficSignIsPlausibleAndNoneStandsOnTheGround) {
  // Width and height of German signs, VwV-StVO, in three sizes of which the second is that of
  // towns.
  const double kinds[][3][2] = {{{0.42, 0.42}, {0.60, 0.60}, {0.75, 0.75}},     // round
                                {{0.63, 0.55}, {0.90, 0.78}, {1.26, 1.09}},     // triangles
                                {{0.42, 0.42}, {0.60, 0.60}, {0.84, 0.84}},     // squares
                                {{0.42, 0.63}, {0.60, 0.90}, {0.84, 1.26}},     // rectangles
                                {{0.42, 0.231}, {0.60, 0.33}, {0.75, 0.412}}};  // plates
  const ClassPriors priors = loadClassPriors(sourceFolder() + "/config/class_priors.yaml");
  const ClassPrior& sign = priors.of("traffic sign");
  ASSERT_EQ(sign.name, "traffic sign");
  EXPECT_EQ(sign.stands, 0.0);
  EXPECT_EQ(sign.moving, 0.0);
  const Eigen::Matrix2d information = sign.log_size_covariance.bottomRightCorner<2, 2>().inverse();
  for (const auto& kind : kinds) {
    for (int size = 0; size < 3; ++size) {
      const Eigen::Vector2d extent(kind[size][0], kind[size][1]);
      const Eigen::Vector2d away = extent.array().log().matrix() - sign.log_size.tail<2>();
      const double gate = TrackParameters{}.size_gate;
      EXPECT_LT(away.dot(information * away), size == 1 ? chi2Quantile(0.95, 2) : gate * gate)
          << extent.transpose();
    }
  }
}

TEST(ClassPriors, ShapesLieWithinTheCuboidAndFillItsLengthAndWidth) {
  const ClassPriors priors = loadClassPriors(sourceFolder() + "/config/class_priors.yaml");
  EXPECT_FALSE(priors.of("car").shape.is_cuboid);
  EXPECT_TRUE(priors.of("zebra crossing").shape.is_cuboid);
  for (const auto& p : priors.classes) {
    Eigen::Vector3d most = Eigen::Vector3d::Zero(), least = most;
    for (int i = 0; i < p.shape.corners(); ++i) {
      const Eigen::Vector3d point = p.shape.corner(i, 1.0);
      most = most.cwiseMax(point), least = least.cwiseMin(point);
    }
    EXPECT_EQ(most, Eigen::Vector3d::Ones()) << p.name << ": size would not be its size";
    EXPECT_EQ(least, -Eigen::Vector3d::Ones()) << p.name;
    EXPECT_TRUE(p.has_yaw || (p.shape.forward == 0.0).all()) << p.name << ": faces nowhere";
  }
}

TEST(ClassPriors, NamesAnInvalidShapeWithItsPlace) {
  for (const char* wrong :
       {"7", "[]", "[[0, 1, 1]]", "[[0, 1, 1, 2]]", "[[-2, 1, 1, 1]]", "[[0, 0.8, 1, 1, 0.3]]",
        "[[0, 1, 1, 1, 0, 0]]", "[[0, 1, 1, 1], [0, 1, 1, 1], [0, 1, 1, 1], [0, 1, 1, 1]]",
        "[[0, 1, wide, 1]]", "[[0, 1, [1], 1]]", "[[0, 1, , 1]]", "[{a: 1}]",
        "[[.nan, 1, 1, 1]]"}) {
    const std::string yaml =
        std::string("fallback: {}\nother: {}\nclasses:\n  car: {shape: ") + wrong + "}\n";
    try {
      parseClassPriors(yaml, "priors.yaml");
      ADD_FAILURE() << "accepted " << wrong;
    } catch (const StartupError& e) {
      EXPECT_NE(std::string(e.what()).find("priors.yaml:4:"), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find("shape: one to three levels"), std::string::npos);
    }
  }
}

TEST(ClassPriors, NamesAKeyThatIsNoText) {
  for (const char* wrong : {"  [car]: {}", "  ~: {}", "  \"\": {}", "  car: {[size]: 1}"}) {
    const std::string yaml = std::string("fallback: {}\nother: {}\nclasses:\n") + wrong + "\n";
    try {
      parseClassPriors(yaml, "priors.yaml");
      ADD_FAILURE() << "accepted " << wrong;
    } catch (const StartupError& e) {
      EXPECT_EQ(e.code(), ExitCode::kConfiguration);
      EXPECT_NE(std::string(e.what()).find("priors.yaml:4:"), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find("are texts"), std::string::npos) << e.what();
    }
  }
}

TEST(ClassPriors, NamesAMissingFile) {
  try {
    loadClassPriors("/nowhere/priors.yaml");
    FAIL() << "accepted";
  } catch (const StartupError& e) {
    EXPECT_EQ(e.code(), ExitCode::kUnavailable);
  }
}

}  // namespace
}  // namespace perdure::semantic_filter
