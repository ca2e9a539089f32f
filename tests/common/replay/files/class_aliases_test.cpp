#include "common/replay/files/class_aliases.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

using ::testing::HasSubstr;

std::string errorOfAliases(const std::string& yaml) {
  const auto file = freshFolder("aliases") / "a.yaml";
  writeText(file, yaml);
  return startupErrorOf([&] { ClassAliases::load(file); });
}

TEST(ClassAliases, TheShippedFileKnowsCommonNamesInAnyCase) {
  const std::string source = std::getenv("PERDURE_SOURCE");
  const auto aliases = ClassAliases::load(source + "/config/class_aliases.yaml");
  EXPECT_EQ(aliases.canonical("Car"), "car");
  EXPECT_EQ(aliases.canonical("Automobile"), "car");
  EXPECT_EQ(aliases.canonical("Pedestrian"), "person");
  EXPECT_EQ(aliases.canonical("Traffic_Sign"), "traffic sign");
  EXPECT_EQ(aliases.canonical(" Giraffe "), "giraffe");
}

TEST(ClassAliases, WhatIsWrongIsLocated) {
  EXPECT_THAT(errorOfAliases("car: [a]\nvan: [A]\n"),
              HasSubstr("a.yaml:2:7: a: is an alias of car"));
  EXPECT_THAT(errorOfAliases("car: auto\n"), HasSubstr("a.yaml:1:6: car: write a list"));
  EXPECT_THAT(errorOfAliases("? [car]\n: [a]\n"), HasSubstr("a.yaml:1:3: the name of a class"));
  EXPECT_THAT(errorOfAliases("- car\n"), HasSubstr("write `name: [alias, …]`"));
  EXPECT_THAT(errorOfAliases("car: [a\n"), HasSubstr("a.yaml:"));
  EXPECT_THAT(startupErrorOf([] { ClassAliases::load("/nowhere.yaml"); }),
              HasSubstr("PERDURE_CONFIG_DIR"));
}

}  // namespace
}  // namespace perdure::replay
