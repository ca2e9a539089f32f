// Checks that the outputs of whole runs equal, byte for byte, those recorded on a machine of the
// same arithmetic.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "common/base/ids.h"
#include "tests/golden/arithmetic.h"
#include "tests/golden/digest_table.h"
#include "tests/golden/runs.h"
#include "tests/process/support.h"

namespace perdure::test {
namespace {

namespace fs = std::filesystem;

fs::path tableFile() { return sources() / "tests/golden/digests.csv"; }

/// A folder beside this program with a run's current outputs ("now") and the outputs of the
/// recorded digests ("kept").
fs::path folderOf(const GoldenRun& run) {
  return fs::read_symlink("/proc/self/exe").parent_path() / "golden" / "runs" / run.name;
}

Digests digestsIn(const fs::path& folder) {
  Digests digests;
  for (const auto& file : goldenFiles()) {
    if (fs::exists(folder / file)) digests[file] = toHex(digest(contentsOf(folder / file)));
  }
  return digests;
}

/// Returns the first difference from the output with the recorded digest, if that output is stored.
std::string whereItDiffers(const fs::path& folder, const std::string& file,
                           const std::string& recorded) {
  const std::string before = contentsOf(folder / "kept" / file);
  if (toHex(digest(before)) != recorded) {
    return "the recorded output is not kept in " + (folder / "kept").string() +
           ": build the code before the change and run this test there once";
  }
  return firstDifference(contentsOf(folder / "now" / file), before);
}

void keep(const fs::path& folder) {
  fs::remove_all(folder / "kept");
  fs::create_directories(folder / "kept");
  for (const auto& file : goldenFiles()) {
    fs::copy_file(folder / "now" / file, folder / "kept" / file);
  }
}

void compare(const GoldenRun& run, const Digests& recorded) {
  const fs::path folder = folderOf(run);
  const Digests now = digestsIn(folder / "now");
  for (const auto& file : goldenFiles()) {
    const auto one = now.find(file), other = recorded.find(file);
    if (one == now.end()) {
      ADD_FAILURE() << run.name << ": " << file << " is not written";
    } else if (other == recorded.end()) {
      ADD_FAILURE() << run.name << ": " << file << " has no digest";
    } else if (one->second != other->second) {
      ADD_FAILURE() << run.name << ": " << file
                    << " is not what was recorded: " << whereItDiffers(folder, file, other->second);
    }
  }
  if (!::testing::Test::HasFailure()) keep(folder);
}

class Golden : public ::testing::TestWithParam<GoldenRun> {};

TEST_P(Golden, OutputsAreThoseThatWereRecorded) {
  const GoldenRun& run = GetParam();
  if (!run.data.empty() && data(run.data).empty()) {
    GTEST_SKIP() << "../shared/data is absent: " << run.name << " is not run";
  }
  const std::string arithmetic = run.pictures ? arithmeticOfPictures() : arithmeticOfNumbers();
  DigestTable table = DigestTable::read(tableFile());
  const Digests recorded = table.of(arithmetic, run.name);
  const bool record = std::getenv("PERDURE_GOLDEN_RECORD") != nullptr;
  if (recorded.empty() && !record) {
    GTEST_SKIP() << "no digests of the arithmetic " << arithmetic
                 << ": on code whose outputs are right, record them with tests/golden/record";
  }
  produce(run, folderOf(run));
  if (!record) return compare(run, recorded);
  table.put(arithmetic, run.name, digestsIn(folderOf(run) / "now"));
  table.write(tableFile());
  keep(folderOf(run));
}

INSTANTIATE_TEST_SUITE_P(Run, Golden, ::testing::ValuesIn(goldenRuns()),
                         [](const auto& test) { return test.param.name; });

TEST(Arithmetic, HasTheSameNameTwiceAndAnotherWithPictures) {
  EXPECT_EQ(arithmeticOfNumbers(), arithmeticOfNumbers());
  EXPECT_EQ(arithmeticOfPictures(), arithmeticOfPictures());
  EXPECT_NE(arithmeticOfNumbers(), arithmeticOfPictures());
  EXPECT_EQ(arithmeticOfNumbers().find(','), std::string::npos);
}

class Table : public ::testing::Test {
 protected:
  Folder folder_;
  const std::string file_ = folder_.file("digests.csv");
};

TEST_F(Table, ReadsBackWhatWasPutAndReplacesARun) {
  DigestTable table;
  table.put("a", "toy", {{"x.csv", "1"}, {"y.csv", "2"}});
  table.put("a", "toy", {{"x.csv", "3"}});
  table.put("b", "toy", {{"x.csv", "4"}});
  table.write(file_);
  const DigestTable again = DigestTable::read(file_);
  EXPECT_EQ(again.of("a", "toy"), (Digests{{"x.csv", "3"}}));
  EXPECT_EQ(again.of("b", "toy"), (Digests{{"x.csv", "4"}}));
  EXPECT_TRUE(again.of("a", "row").empty());
  EXPECT_EQ(contentsOf(file_), "arithmetic,run,file,digest\na,toy,x.csv,3\nb,toy,x.csv,4\n");
}

TEST_F(Table, NamesALineThatIsWrong) {
  std::ofstream(file_) << "arithmetic,run,file,digest\na,toy,x.csv\n";
  try {
    DigestTable::read(file_);
    FAIL() << "a row of three fields is taken";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("digests.csv:2:"), std::string::npos) << error.what();
  }
}

TEST(FirstDifference, NamesTheLineAndBothTexts) {
  EXPECT_EQ(firstDifference("a\nb\n", "a\nb\n"), "");
  EXPECT_EQ(firstDifference("a\nb\n", "a\nc\n"), "line 2: `b`, was `c`");
  EXPECT_EQ(firstDifference("a\n", "a\nc\n"), "line 2: `(the end)`, was `c`");
  EXPECT_EQ(firstDifference("a\n", "a"), "the end of the last line");
  EXPECT_EQ(firstDifference(std::string(60, 'x') + "1", std::string(60, 'x') + "2"),
            "line 1, from character 21: `" + std::string(40, 'x') + "1`, was `" +
                std::string(40, 'x') + "2`");
}

}  // namespace
}  // namespace perdure::test
