// Runs each target on damaged seeds, the same ones on every machine. A target must accept or reject
// them; any other behaviour fails.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <ostream>
#include <set>

#include "tests/fuzz/mutator.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace perdure::fuzz {

void PrintTo(const Target& target, std::ostream* out) { *out << target.name; }

namespace {

/// Returns the fault in the handling of the bytes, or "".
std::string faultOf(const Target& target, const Bytes& bytes, bool* taken = nullptr) {
  try {
    const bool took = target.take(bytes);
    if (taken != nullptr) *taken = took;
    return "";
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "something was thrown that is no exception";
  }
}

/// Saves the bytes beside this program, for inspection and for perdure-fuzz.
std::string keep(const Target& target, const Bytes& bytes) {
  const auto program = std::filesystem::read_symlink("/proc/self/exe");
  const auto file = program.parent_path() / ("fuzz-" + target.name);
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  return file.string();
}

class Fuzz : public ::testing::TestWithParam<Target> {};

TEST_P(Fuzz, SeedsAreTaken) {
  for (const Bytes& seed : GetParam().seeds()) {
    bool taken = false;
    EXPECT_EQ(faultOf(GetParam(), seed, &taken), "");
    EXPECT_TRUE(taken) << textOf(seed).substr(0, 200);
  }
}

TEST_P(Fuzz, DamagedSeedsAreTakenOrRefused) {
  const Target& target = GetParam();
  const auto seeds = target.seeds();
  Mutator mutator(20240501);
  int took = 0;
  for (int i = 0; i < target.runs; ++i) {
    const std::size_t n = static_cast<std::size_t>(i);
    const Bytes bytes =
        mutator.damaged(seeds[n % seeds.size()], seeds[(n / seeds.size()) % seeds.size()]);
    bool taken = false;
    const std::string fault = faultOf(target, bytes, &taken);
    took += taken ? 1 : 0;
    if (!fault.empty()) {
      FAIL() << target.name << ", input " << i << ", kept in " << keep(target, bytes) << ": "
             << fault;
    }
  }
  EXPECT_GT(took, 0) << "nothing that is damaged is taken: the damage is too coarse";
  EXPECT_LT(took, target.runs) << "nothing is refused";
}

INSTANTIATE_TEST_SUITE_P(Of, Fuzz, ::testing::ValuesIn(targets()),
                         [](const auto& test) { return test.param.name; });

TEST(Mutator, GivesTheSameTwiceAndOtherThingsThanTheSeed) {
  const Bytes seed = bytesOf("a: 1.5\nb: [2, 3]\n"), other = bytesOf("c: 4\n");
  Mutator one(3), same(3), differs(4);
  std::set<Bytes> seen;
  bool parted = false;
  for (int i = 0; i < 100; ++i) {
    const Bytes bytes = one.damaged(seed, other);
    EXPECT_EQ(bytes, same.damaged(seed, other));
    parted |= bytes != differs.damaged(seed, other);
    seen.insert(bytes);
  }
  EXPECT_TRUE(parted);
  EXPECT_GT(seen.size(), 60U);
}

TEST(Scratch, FilesOfAFolderComeBackAndThoseThatAreMissingGo) {
  const auto folder = scratch() / "there";
  std::filesystem::create_directories(folder);
  const std::vector<std::string> names{"a.txt", "b.txt", "c.txt"};
  unpack(bytesOf("=== a.txt\n1\n=== c.txt\n3\n3\n=== d.txt\n4\n"), folder, names);
  EXPECT_EQ(textOf(pack(folder, names)), "=== a.txt\n1\n=== c.txt\n3\n3\n");
  EXPECT_FALSE(std::filesystem::exists(folder / "d.txt"));
  unpack(bytesOf("=== b.txt\n=== a.txt\n2"), folder, names);
  EXPECT_EQ(textOf(pack(folder, names)), "=== a.txt\n2\n=== b.txt\n");
}

}  // namespace
}  // namespace perdure::fuzz
