#include "common/base/scratch.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>
#include <string>
#include <thread>

#include "common/base/shared_vector.h"

namespace perdure {
namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr bool kHeapOnly = true;
#else
constexpr bool kHeapOnly = false;
#endif

TEST(Scratch, IsTakenAgainAfterItsScope) {
  if (kHeapOnly) GTEST_SKIP() << "AddressSanitizer has every vector on the heap";
  const auto takeOne = [] {
    const ScratchScope scope;
    ScratchVector<double> v(100, 1.0);
    return reinterpret_cast<std::uintptr_t>(v.data());
  };
  const auto first = takeOne();
  EXPECT_EQ(takeOne(), first);
  const ScratchScope outer;
  const ScratchVector<double> kept(100, 2.0);
  const auto inner = takeOne();
  EXPECT_NE(inner, first) << "an inner scope leaves what the outer one holds";
  EXPECT_EQ(takeOne(), inner);
  EXPECT_EQ(kept, ScratchVector<double>(100, 2.0));
}

TEST(Scratch, ServesFromTheHeapWithoutScopeOrSpace) {
  ScratchVector<int> outside(1000);
  std::iota(outside.begin(), outside.end(), 0);
  {
    const ScratchScope scope;
    ScratchVector<std::byte> larger_than_the_block(std::size_t{64} << 20);
    larger_than_the_block.back() = std::byte{1};
    ScratchMap<std::string, int> counts;
    for (int i = 0; i < 1000; ++i) ++counts[std::to_string(i % 10)];
    EXPECT_EQ(counts.at("7"), 100);
  }
  EXPECT_EQ(outside[999], 999);
}

TEST(Scratch, EachThreadHasItsOwn) {
  const ScratchScope scope;
  const ScratchVector<int> here(100, 1);
  std::thread([] {
    const ScratchScope other;
    const ScratchVector<int> there(100, 2);
    EXPECT_EQ(there.back(), 2);
  }).join();
  EXPECT_EQ(here.back(), 1);
}

TEST(SharedVector, CopiesPartWhenOneIsWrittenTo) {
  SharedVector<std::string> a = {"one", "two"};
  SharedVector<std::string> b = a;
  EXPECT_EQ(&a.read(), &b.read());
  b.push_back("three");
  EXPECT_EQ(a.size(), 2U);
  EXPECT_EQ(b.size(), 3U);
  a = b;
  EXPECT_EQ(&a.read(), &b.read());
  a = std::move(b);
  EXPECT_EQ(a.back(), "three");
  a.clear();
  EXPECT_TRUE(a.empty());
}

TEST(SharedVector, LeavesItsMemoryToTheNext) {
  SharedVector<double> a(std::vector<double>(100, 1.0));
  const double* const memory = a.read().data();
  a.clear();
  SharedVector<double> b;
  b.assign(50, 2.0);
  EXPECT_EQ(b.read().data(), memory);
  EXPECT_EQ(b.size(), 50U) << "nothing of the one before is left";
}

}  // namespace
}  // namespace perdure
