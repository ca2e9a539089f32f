#include "common/base/process/held_errors.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace perdure
