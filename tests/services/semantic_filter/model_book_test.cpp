#include "services/semantic_filter/model_book.h"

#include <gtest/gtest.h>

#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

ModelInfo carsOf(std::uint64_t hash, std::vector<std::string> classes) {
  ModelInfo info;
  info.hash = hash;
  info.name = "boxes.csv";
  info.classes = std::move(classes);
  info.box_sigma = 0.04;
  return info;
}

/// Returns whether the second model counts as the network of the first.
bool oneNetwork(const ModelInfo& first, const ModelInfo& second) {
  ModelBook book(testing::makePriors());
  EXPECT_TRUE(book.add(first) && book.add(second));
  return book.find(first.hash)->network == book.find(second.hash)->network;
}

TEST(ModelBook, AModelThatOnlyAddsClassesIsOfTheSameNetwork) {
  const ModelInfo car = carsOf(1, {"car"});
  EXPECT_TRUE(oneNetwork(car, carsOf(2, {"car", "van"})));
  EXPECT_FALSE(oneNetwork(car, carsOf(2, {"van", "car"})));
  EXPECT_FALSE(oneNetwork(carsOf(1, {"car", "van"}), carsOf(2, {"car"})));
  ModelInfo other = carsOf(2, {"car", "van"});
  other.name = "other.csv";
  EXPECT_FALSE(oneNetwork(car, other));
}

TEST(ModelBook, ARetrainedNetworkOfTheSameNameIsAnother) {
  const ModelInfo car = carsOf(1, {"car"});
  ModelInfo noisier = carsOf(2, {"car", "van"}), larger = noisier, outlines = noisier;
  noisier.box_sigma = 0.1;
  larger.input_width = 640;
  outlines.boxes = BoxExtent::kOutline;
  for (const ModelInfo& other : {noisier, larger, outlines}) EXPECT_FALSE(oneNetwork(car, other));
}

}  // namespace
}  // namespace perdure::semantic_filter
