// Tests when detections of a new process count as implausible, compared with those of the current
// process.
#include "services/inference/core/takeover/judge.h"

#include <gtest/gtest.h>

#include "tests/services/inference/core/takeover/swap_messages.h"

namespace perdure::inference {
namespace {

TEST(Judge, AsksForNonsenseOnlyWhereThereIsEnoughToCompare) {
  Judge judge;
  judge.learn(modelOf(kOld, {"car", "person"}));
  judge.learn(modelOf(kNew, {"car", "person"}));
  for (std::size_t i = 0; i < Judge::kEnough; ++i) {
    EXPECT_FALSE(judge.complaint()) << i;
    judge.compare(listOf(kOld, i, kStreet), listOf(kNew, i, {}));
  }
  ASSERT_TRUE(judge.complaint());
  EXPECT_EQ(judge.complaint()->code, "empty");
  judge.reset();
  EXPECT_FALSE(judge.complaint());
  for (std::size_t i = 0; i < 50; ++i) {  // half of the current process's objects are enough
    judge.compare(listOf(kOld, i, kStreet), listOf(kNew, i, {boxAt(21, 0.1F)}));
    EXPECT_FALSE(judge.complaint());
  }
  EXPECT_EQ(judge.summary(), "50 frames; 50 % of 100 certain objects detected");
}

TEST(Judge, AnswersToPredictionsAreNoSight) {
  Judge judge;
  judge.learn(modelOf(kOld, {"car", "person"}));
  judge.learn(modelOf(kNew, {"car", "person"}));
  std::vector<Detection> answers = kStreet;
  for (Detection& d : answers) d.primed = true;
  for (std::size_t i = 0; i < Judge::kEnough; ++i) {
    judge.compare(listOf(kOld, i, kStreet), listOf(kNew, i, answers));
  }
  ASSERT_TRUE(judge.complaint());
  EXPECT_EQ(judge.complaint()->code, "empty");
}

TEST(Judge, ComplainsOfDetectionsWhoseModelNobodyPublished) {
  Judge judge;
  judge.learn(modelOf(kOld, {"car", "person"}));
  for (std::size_t i = 0; i < Judge::kEnough; ++i) {
    judge.compare(listOf(kOld, i, kStreet), listOf(kNew, i, kStreet));
  }
  ASSERT_TRUE(judge.complaint());
  EXPECT_EQ(judge.complaint()->code, "unknown_model");
}

}  // namespace
}  // namespace perdure::inference
