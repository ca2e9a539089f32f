#include "common/base/algorithms/folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace perdure {
namespace {

namespace fs = std::filesystem;

const auto kAll = [](const fs::path&) { return true; };

TEST(PathsIn, AreSortedAndThoseThatAreWanted) {
  const fs::path folder = fs::path(testing::TempDir()) / "paths_in";
  fs::remove_all(folder);
  fs::create_directories(folder);
  for (const char* name : {"c.txt", "a.txt", "b.csv"}) std::ofstream(folder / name) << "x";
  const auto texts = pathsIn(folder, [](const fs::path& p) { return p.extension() == ".txt"; });
  EXPECT_THAT(texts, testing::ElementsAre(folder / "a.txt", folder / "c.txt"));
  EXPECT_TRUE(pathsIn(folder / "none", kAll).empty());
  EXPECT_TRUE(pathsIn(folder / "a.txt", kAll).empty());
}

TEST(PathsIn, AFolderThatCannotBeReadIsRefusedWithTheReason) {
  const fs::path link = fs::path(testing::TempDir()) / "paths_in_circle";
  fs::remove(link);
  fs::create_symlink(link, link);
  try {
    (void)pathsIn(link, kAll);
    FAIL() << "it was read";
  } catch (const StartupError& error) {
    EXPECT_EQ(error.code(), ExitCode::kUnavailable);
    EXPECT_THAT(error.what(), testing::HasSubstr("symbolic links"));
  }
}

}  // namespace
}  // namespace perdure
