#include "common/base/algorithms/stable_sort.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>

namespace perdure {
namespace {

/// Can be moved alone.
struct Item {
  double key;
  std::unique_ptr<int> place;
};

TEST(StableSortBy, OrdersAsTheStandardLibraryDoes) {
  std::mt19937 random(1);
  for (int size = 0; size < 60; ++size) {
    std::vector<Item> items;
    std::vector<std::pair<double, int>> expected;
    for (int i = 0; i < size; ++i) {
      const double key = static_cast<double>(random() % 8) - 4.0;
      items.push_back({key, std::make_unique<int>(i)});
      expected.emplace_back(key, i);
    }
    stableSortBy(items, [](const Item& item) { return item.key; });
    std::stable_sort(expected.begin(), expected.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (std::size_t i = 0; i < items.size(); ++i) {
      EXPECT_EQ(items[i].key, expected[i].first);
      EXPECT_EQ(*items[i].place, expected[i].second);
    }
  }
}

TEST(StableSortBy, KeepsEveryBitOfAnId) {
  constexpr std::uint64_t kLarge = 1ULL << 60;
  std::vector<std::uint64_t> ids = {kLarge + 2, kLarge + 1, kLarge, 7};
  stableSortBy(ids, [](const std::uint64_t& id) { return id; });
  EXPECT_THAT(ids, testing::ElementsAre(7, kLarge, kLarge + 1, kLarge + 2));
}

}  // namespace
}  // namespace perdure
