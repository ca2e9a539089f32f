#include "common/base/process/held_errors.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

namespace perdure {
namespace {

TEST(HeldErrors, PassOnWhatIsWorthItAndEndWithTheirLife) {
  ::testing::internal::CaptureStderr();
  {
    const HeldErrors held([](const std::string& line) { return !line.starts_with("dull"); });
    std::cerr << "dull: one\nworse\n"
              << "dull: two\n";
  }
  std::cerr << "dull no more\n";
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "worse\ndull no more\n");
}

TEST(HeldErrors, PrintALineBeforeTheProcessAborts) {
  EXPECT_DEATH(
      {
        const HeldErrors held([](const std::string&) { return true; });
        std::cerr << "the cause\n";
        std::abort();
      },
      "the cause");
}

}  // namespace
}  // namespace perdure
