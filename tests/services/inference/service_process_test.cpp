// Tests one real inference process: under a time budget, and with more frames than it can process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/inference/service_rig.h"

namespace perdure::inference {
namespace {

using Rig = testing::ServiceRig;

/// With a lease of half a minute: on a crowded machine results are late, and Health would say that
/// instead of what is tried here.
std::vector<std::string> committedModel() {
  return {"--set", "model.path=" + (test::sources() / "models/perdure_320x240.onnx").string(),
          "--set", "ownership.period_s=10"};
}

std::vector<std::string> operator+(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(InferenceService, ABudgetThatCannotBeKeptMakesTheInputSmallerAndHealthSaysSo) {
  Rig rig(test::ownNetwork(), committedModel() + std::vector<std::string>{"--budget-ms", "0.5"});
  for (int i = 0; i < 20; ++i) {
    rig.send();
    ASSERT_TRUE(rig.answered(rig.sent - 1)) << rig.service->log();
  }
  EXPECT_DOUBLE_EQ(rig.answers.front().input_scale, 1.0);
  EXPECT_LT(rig.answers.back().input_scale, 0.65);
  const auto says = [&](const char* words) {
    return rig.health.message.find(words) != std::string::npos;
  };
  EXPECT_TRUE(rig.until([&] {
    return rig.health.reasons.contains("input_smaller") &&
           says("% of its width, for the budget of 0 ms") && says("ms old");
  })) << rig.health.message;
}

TEST(InferenceService, ABudgetThatIsKeptLeavesTheInputAlone) {
  Rig rig(test::ownNetwork(), committedModel() + std::vector<std::string>{"--budget-ms", "10000"});
  for (int i = 0; i < 12; ++i) {
    rig.send();
    ASSERT_TRUE(rig.answered(rig.sent - 1)) << rig.service->log();
  }
  for (const Detections& d : rig.answers) {
    EXPECT_DOUBLE_EQ(d.input_scale, 1.0);
    EXPECT_GT(d.forward_s, 1e-4);
    EXPECT_LT(d.forward_s, 10.0);
  }
  EXPECT_FALSE(rig.health.reasons.contains("input_smaller"));
}

TEST(InferenceService, TurnsImagesByTheOdometryAndPublishesTheModelOfTheTurn) {
  Rig rig(test::ownNetwork(), committedModel());
  rig.send();
  ASSERT_TRUE(rig.answered(0)) << rig.service->log();
  const std::uint64_t plain = rig.answers.front().model_hash;
  EXPECT_TRUE(rig.until([&] { return rig.models[plain] == "perdure_320x240"; }));
  rig.sendUpsideDown();
  for (int i = 0; i < 50 && rig.answers.back().model_hash == plain; ++i) {
    rig.send();
    ASSERT_TRUE(rig.answered(rig.sent - 1)) << rig.service->log();
  }
  const std::uint64_t turned = rig.answers.back().model_hash;
  EXPECT_TRUE(rig.until([&] { return rig.models[turned] == "perdure_320x240, turned by 180°"; }));
}

TEST(InferenceService, LooksAtTheNewestFrameAndItsAnswersKnowWhenTheyWereTaken) {
  Rig rig(test::ownNetwork(), committedModel());
  constexpr std::uint64_t kBurst = 40;
  for (std::uint64_t i = 0; i < kBurst; ++i) rig.send();
  ASSERT_TRUE(rig.answered(kBurst - 1)) << "the newest one is looked at";
  ASSERT_TRUE(rig.until([&] { return rig.health.frames_out == rig.answers.size(); }));
  EXPECT_LT(rig.answers.size(), kBurst) << "it looked at frames that were old already";
  for (std::size_t i = 0; i < rig.answers.size(); ++i) {
    const FrameStamp& stamp = rig.answers[i].stamp;
    EXPECT_EQ(stamp.captured_ns, 1'000'001 + static_cast<std::int64_t>(stamp.sequence));
    EXPECT_TRUE(i == 0 || stamp.sequence > rig.answers[i - 1].stamp.sequence);
  }
  EXPECT_EQ(rig.health.frames_in, rig.health.frames_out + rig.health.dropped)
      << "each frame is answered or counted";
}

}  // namespace
}  // namespace perdure::inference
