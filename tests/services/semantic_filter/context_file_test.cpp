#include "services/semantic_filter/context_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/errors.h"

namespace perdure::semantic_filter {
namespace {

using ::testing::HasSubstr;

ContextMatrix matrixOf(double car_car, double car_van, double van_van) {
  ContextMatrix matrix;
  matrix.radius_m = 10.0;
  matrix.classes = {"car", "van"};
  matrix.log_ratio.resize(2, 2);
  matrix.log_ratio << car_car, car_van, car_van, van_van;
  return matrix;
}

TEST(ContextFile, IsReadAsItIsWritten) {
  const auto matrix = matrixOf(0.25, -1.5, 3.125);
  const auto back = parseContext(formatContext(matrix, "A note."), "context.yaml");
  EXPECT_EQ(back.radius_m, matrix.radius_m);
  EXPECT_EQ(back.classes, matrix.classes);
  EXPECT_EQ(back.log_ratio, matrix.log_ratio);
  EXPECT_EQ(back.of("car", "van"), -1.5);
  EXPECT_EQ(back.of("car", "zebra"), 0.0);
}

std::string complaintAbout(const std::string& yaml) {
  try {
    parseContext(yaml, "c.yaml");
  } catch (const StartupError& e) {
    EXPECT_EQ(e.code(), ExitCode::kConfiguration);
    return e.what();
  }
  return "accepted";
}

TEST(ContextFile, NamesEveryMistakeWithItsPlace) {
  const std::string text = complaintAbout(
      "radius: -1\n"
      "classes: [car, Van, car, other]\n"
      "log_ratio:\n"
      "  - [0, 1, 2, 3]\n"
      "  - [1, 0, 2, x]\n"
      "  - [9, 2, 0, 4]\n"
      "  - [3, 0, 4, 99]\n");
  EXPECT_THAT(text, HasSubstr("c.yaml:1:9: radius:"));
  EXPECT_THAT(text, HasSubstr("c.yaml:2:16: classes: names are lower-case"));
  EXPECT_THAT(text, HasSubstr("c.yaml:2:21: classes: car is there twice"));
  EXPECT_THAT(text, HasSubstr("\"other\" has no context"));
  EXPECT_THAT(text, HasSubstr("c.yaml:5:15: log_ratio: is not a number"));
  EXPECT_THAT(text, HasSubstr("c.yaml:6:6: log_ratio: differs"));
  EXPECT_THAT(text, HasSubstr("c.yaml:7:15: log_ratio: is not a number"));
  EXPECT_THAT(complaintAbout("radius: 3\nclasses: [a, b]\nlog_ratio: [[0, 1]]\n"),
              HasSubstr("write 2 rows of 2 numbers"));
  EXPECT_THAT(complaintAbout("radius: 3\nclasses: [a]\n"), HasSubstr("learn-context"));
  EXPECT_THAT(complaintAbout("radius: ["), HasSubstr("c.yaml:"));
}

}  // namespace
}  // namespace perdure::semantic_filter
