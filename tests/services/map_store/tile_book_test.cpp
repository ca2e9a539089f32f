#include "services/map_store/core/tile_book.h"

#include <gtest/gtest.h>

namespace perdure::map_store {
namespace {

std::vector<MapObject> objects(std::size_t count) {
  std::vector<MapObject> result(count);
  for (std::size_t i = 0; i < count; ++i) result[i].id = i + 1;
  return result;
}

TEST(TileBook, CutsASquareIntoTilesOfLimitedSize) {
  TileBook book;
  const auto changes = book.replace({2, -3}, objects(300), 9, 4);
  ASSERT_EQ(changes.tiles.size(), 3u);
  EXPECT_TRUE(changes.emptied.empty());
  EXPECT_EQ(changes.tiles[0].objects.size(), 128u);
  EXPECT_EQ(changes.tiles[2].objects.size(), 44u);
  EXPECT_EQ(changes.tiles[2].objects.front().id, 257u);
  EXPECT_EQ(changes.tiles[1].x, 2);
  EXPECT_EQ(changes.tiles[1].y, -3);
  EXPECT_EQ(changes.tiles[1].part, 1);
  EXPECT_EQ(changes.tiles[1].revision, 4u);
  EXPECT_EQ(changes.tiles[1].instance, 9u);
  EXPECT_EQ(book.tiles(), 3u);
  EXPECT_EQ(book.objects(), 300u);
}

TEST(TileBook, FillsATileToItsCapacityBeforeTheNext) {
  TileBook book;
  EXPECT_EQ(book.replace({0, 0}, objects(128), 1, 1).tiles.size(), 1u);
  EXPECT_EQ(book.replace({0, 0}, objects(129), 1, 2).tiles.size(), 2u);
}

TEST(TileBook, NamesTheTilesThatWereEmptied) {
  TileBook book;
  book.replace({0, 0}, objects(300), 1, 1);
  book.replace({1, 0}, objects(5), 1, 1);
  const auto fewer = book.replace({0, 0}, objects(10), 1, 2);
  EXPECT_EQ(fewer.tiles.size(), 1u);
  ASSERT_EQ(fewer.emptied.size(), 2u);
  EXPECT_EQ(fewer.emptied[0].part, 1);
  EXPECT_EQ(fewer.emptied[1].part, 2);
  const auto none = book.replace({0, 0}, {}, 1, 3);
  EXPECT_TRUE(none.tiles.empty());
  EXPECT_EQ(none.emptied.size(), 1u);
  EXPECT_EQ(book.tiles(), 1u);
  EXPECT_EQ(book.objects(), 5u);
}

TEST(TileBook, SaysNothingOfASquareThatStaysEmpty) {
  TileBook book;
  const auto changes = book.replace({7, 7}, {}, 1, 1);
  EXPECT_TRUE(changes.tiles.empty());
  EXPECT_TRUE(changes.emptied.empty());
}

}  // namespace
}  // namespace perdure::map_store
