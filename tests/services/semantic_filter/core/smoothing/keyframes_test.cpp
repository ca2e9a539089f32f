#include "services/semantic_filter/core/smoothing/keyframes.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/services/semantic_filter/core/smoothing/passing_car.h"

namespace perdure::semantic_filter {
namespace {

using testing::Passing;

TEST(Keyframes, NewViewpointsAreKeptAndTheMostSimilarOneIsDropped) {
  const Passing scene(1);
  SmoothingParameters parameters;
  parameters.keyframes = 6;
  parameters.new_view = 0.05;
  const ViewScales scales{0.3, 0.3, 0.3};
  Track object;
  Hypothesis h = scene.start(false);
  h.x = scene.truth();
  object.hypotheses = {h};
  for (const auto& k : scene.keyframes()) addKeyframe(object, *k, scales, parameters);
  ASSERT_EQ(object.batch.keyframes.size(), 6U);
  EXPECT_FALSE(addKeyframe(object, *scene.keyframes().back(), scales, parameters));
  EXPECT_TRUE(
      std::is_sorted(object.batch.keyframes.begin(), object.batch.keyframes.end(),
                     [](const auto& a, const auto& b) { return a->from->time < b->from->time; }));
  // Keyframes span the whole drive, not only its end.
  EXPECT_LT(toSeconds(object.batch.keyframes.front()->from->time), 1.5);
  Track other = object;
  other.batch.keyframes = {scene.keyframes()[1], scene.keyframes()[2]};
  mergeBatches(object, other, scales, parameters);
  EXPECT_LE(object.batch.keyframes.size(), 6U);
}

}  // namespace
}  // namespace perdure::semantic_filter
