#include "common/replay/files/text_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(TextFile, LinesAreTrimmedNumberedAndNeverEmpty) {
  const auto file = freshFolder("text") / "a.txt";
  writeText(file, "one\r\n\n  two  \nthree");
  const auto lines = readLines(file, "");
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[1].text, "two");
  EXPECT_EQ(lines[1].number, 3U);
  EXPECT_EQ(lines[2].text, "three");
}

TEST(TextFile, AMarkOfUtf8IsNoText) {
  const auto file = freshFolder("text") / "a.txt";
  writeText(file,
            "\xEF\xBB\xBF"
            "1,2\n\xEF\xBB\xBF"
            "3\n");
  const auto lines = readLines(file, "");
  EXPECT_EQ(lines[0].text, "1,2");
  EXPECT_EQ(lines[1].text,
            "\xEF\xBB\xBF"
            "3")
      << "it stands at a file's begin alone";
  writeText(file, std::string("\xFF\xFE"
                              "1\0",
                              4));
  EXPECT_THAT(startupErrorOf([&] { readLines(file, ""); }), HasSubstr("UTF-16; save it as UTF-8"));
}

TEST(TextFile, FieldsAreSeparatedByCommasElseSemicolonsElseBlanks) {
  EXPECT_THAT(fieldsOf("a b, c,"), ElementsAre("a b", "c"));
  EXPECT_THAT(fieldsOf("a; b"), ElementsAre("a", "b"));
  EXPECT_THAT(fieldsOf("a\tb"), ElementsAre("a", "b"));
}

TEST(TextFile, AHeaderHoldsNoNumber) {
  EXPECT_TRUE(isHeader({"timestamp", "tx", "nanoseconds"}));
  EXPECT_FALSE(isHeader({"word"}));
  for (const char* field : {"1", "-inf", "NaN", ".5", "", "1x"})
    EXPECT_FALSE(isHeader({"tx", field}));
}

TEST(TextFile, AMissingFileIsNamedWithTheFix) {
  const auto error = startupErrorOf([] { readLines("/nowhere/x.csv", "make it"); });
  EXPECT_THAT(error, HasSubstr("/nowhere/x.csv"));
  EXPECT_THAT(error, HasSubstr("make it"));
}

TEST(TextFile, SplitsAtCommasKeepingEmptyFieldsAndAtRunsOfBlanks) {
  EXPECT_THAT(split("a, b,,c", ','), ElementsAre("a", "b", "", "c"));
  EXPECT_THAT(split("  a \t b  ", ' '), ElementsAre("a", "b"));
}

TEST(TextFile, OnlyWholeFiniteNumbersAreNumbers) {
  EXPECT_EQ(parseNumber(" 1e-3 "), 1e-3);
  EXPECT_EQ(parseNumber("+2.5"), 2.5);
  for (const char* text : {"", "x", "1x", "nan", "inf", "1e999", "1,2"}) {
    EXPECT_EQ(parseNumber(text), std::nullopt) << text;
  }
  EXPECT_EQ(parseInteger("-7"), -7);
  EXPECT_EQ(parseInteger("7.0"), std::nullopt);
}

TEST(TextFile, ComplaintsNameFileAndLineAndCountTheRest) {
  Complaints complaints("file.csv");
  EXPECT_NO_THROW(complaints.throwIfAny());
  for (std::size_t line = 1; line <= 12; ++line) complaints.add(line, "is wrong");
  const auto error = startupErrorOf([&] { complaints.throwIfAny(); });
  EXPECT_THAT(error, HasSubstr("file.csv:1: is wrong"));
  EXPECT_THAT(error, HasSubstr("file.csv:10: is wrong"));
  EXPECT_THAT(error, HasSubstr("and 2 more"));
  EXPECT_EQ(startupCodeOf([&] { complaints.throwIfAny(); }), ExitCode::kData);
}

}  // namespace
}  // namespace perdure::replay
