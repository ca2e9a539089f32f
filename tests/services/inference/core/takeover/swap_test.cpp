// Runs the new and the old process as two state machines on one simulated topic. Tests the
// messages of each, the owner of the topic, and that no frame is lost, whatever happens.
#include "services/inference/core/takeover/swap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <set>

#include "tests/services/inference/core/takeover/swap_messages.h"

namespace perdure::inference {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
constexpr Duration kShortLease = milliseconds(100);
constexpr auto kPeriod = milliseconds(33);

/// The answer of a process to a frame; nothing if the process is stopped or dead.
using Answer = std::function<std::optional<Result<Detections>>(std::uint64_t frame)>;

Answer sees(InstanceId who, std::vector<Detection> boxes) {
  return [=](std::uint64_t frame) { return listOf(who, frame, boxes); };
}

/// The topic with DDS ownership: the strongest writer that has written within a lease is the owner.
struct Bus {
  struct Process {
    Process(Swap swap_of, Answer answer_of, int strength_of)
        : swap(std::move(swap_of)), answer(std::move(answer_of)), strength(strength_of) {}
    Swap swap;
    Answer answer;
    int strength;
    bool silent = false, ended = false;
    std::string failure;
    Swap::Time wrote{};
  };
  std::map<InstanceId, Process> processes;
  std::vector<SwapNotice> notices;
  std::vector<Detections> heard;
  Swap::Time now{std::chrono::hours(1)};
  std::uint64_t frame = 0;

  Bus() { setClasses({"car", "person"}, {"car", "person"}); }
  void setClasses(const std::vector<std::string>& old, const std::vector<std::string>& fresh) {
    constexpr double kProbation = 2.0;
    processes.clear();
    processes.try_emplace(kOld, Swap({kOld, "old", 0.0, kShortLease}), sees(kOld, kStreet), 10);
    processes.try_emplace(kNew, Swap({kNew, "new", kProbation, kShortLease}), sees(kNew, kStreet),
                          -1);
    for (auto& [id, p] : processes) {
      p.swap.learn(modelOf(kOld, old));
      p.swap.learn(modelOf(kNew, fresh));
    }
  }
  Process& elder() { return processes.at(kOld); }
  Process& newcomer() { return processes.at(kNew); }

  InstanceId owner() const {
    InstanceId best = 0;
    for (const auto& [id, p] : processes) {
      const bool lives = !p.silent && !p.ended && now - p.wrote <= kShortLease;
      if (lives && (best == 0 || p.strength > processes.at(best).strength)) best = id;
    }
    return best;
  }
  /// Returns whether the process runs; a stopped or dead process receives no messages.
  bool lives(const Process& p) const { return !p.ended && p.answer(frame); }
  void deliver(const Detections& d) {
    processes.at(d.instance).wrote = now;
    if (owner() != d.instance) return;
    heard.push_back(d);
    for (auto& [id, p] : processes) {
      if (!lives(p)) continue;
      p.swap.heard(d, now);
      obey(id);
    }
  }
  void obey(InstanceId id) {
    Process& p = processes.at(id);
    const Swap::Actions actions = p.swap.take();
    if (actions.lead) p.strength = std::max(elder().strength, newcomer().strength) + 10;
    p.silent = p.silent || actions.yield;
    for (const Detections& d : actions.again) deliver(d);
    for (const SwapNotice& n : actions.notices) {
      notices.push_back(n);
      for (auto& [other, q] : processes) {
        if (other == id || !lives(q)) continue;
        q.swap.told(n, now);
        obey(other);
      }
    }
    p.ended = p.ended || actions.end;
    if (actions.end) p.failure = actions.failure;
  }
  void step() {
    for (auto& [id, p] : processes) {
      if (p.ended) continue;
      const auto answer = p.answer(frame);
      if (!answer) continue;
      if (*answer) {
        p.swap.ownResult(**answer, true, now);
        obey(id);
        if (!p.silent) deliver(**answer);
      } else {
        p.swap.ownFailure(answer->error());
        obey(id);
      }
    }
    ++frame;
    for (int i = 0; i < 2; ++i) {
      now += kPeriod / 2;
      for (auto& [id, p] : processes) {
        if (!p.ended && p.answer(frame)) p.swap.tick(now), obey(id);
      }
    }
  }
  void run(int frames) {
    for (int i = 0; i < frames; ++i) step();
  }
  void runUntilTakenOver() {
    for (int i = 0; i < 100 && owner() != kNew; ++i) step();
    ASSERT_EQ(owner(), kNew);
  }
  std::set<std::uint64_t> answered() const {
    std::set<std::uint64_t> frames;
    for (const auto& d : heard) frames.insert(d.stamp.sequence);
    return frames;
  }
  std::vector<SwapStep> steps() const {
    std::vector<SwapStep> all;
    for (const auto& n : notices) all.push_back(n.step);
    return all;
  }
};

TEST(Swap, ANewcomerRehearsesTakesOverPassesAndTheOldOneRetires) {
  Bus bus;
  bus.run(10);
  EXPECT_EQ(bus.owner(), kOld) << "it rehearses";
  bus.run(100);
  EXPECT_EQ(bus.owner(), kNew);
  EXPECT_THAT(bus.steps(), ElementsAre(SwapStep::kRehearsing, SwapStep::kTookOver,
                                       SwapStep::kPassed, SwapStep::kRetired));
  EXPECT_TRUE(bus.elder().ended);
  EXPECT_EQ(bus.elder().failure, "");
  EXPECT_FALSE(bus.newcomer().ended);
  EXPECT_EQ(bus.answered().size(), bus.frame);
  EXPECT_THAT(bus.notices.back().detail, HasSubstr("100 % of"));
}

TEST(Swap, TheProbationLastsAsLongAsItWasAskedFor) {
  Bus bus;
  bus.runUntilTakenOver();
  const auto taken = bus.now;
  while (!bus.elder().ended) bus.step();
  EXPECT_NEAR(toSeconds(bus.now - taken), 2.0, 0.05);
}

struct Nonsense {
  std::string reason;
  Answer answer;
};

std::vector<Nonsense> nonsense() {
  std::vector<Detection> flood, elsewhere;
  for (int i = 0; i < 30; ++i) flood.push_back(boxAt(20 + 6 * i, 1));
  for (int i = 0; i < 3; ++i) elsewhere.push_back(boxAt(500 + 60 * i, 4));
  return {{"empty", sees(kNew, {})},
          {"flood", sees(kNew, flood)},
          {"elsewhere", sees(kNew, elsewhere)},
          {"fails", [](std::uint64_t) {
             return Result<Detections>(fail("model_output_not_finite", "NaN"));
           }}};
}

TEST(Swap, NonsenseFromTheStartIsNeverHeard) {
  for (const auto& [reason, answer] : nonsense()) {
    SCOPED_TRACE(reason);
    Bus bus;
    bus.newcomer().answer = answer;
    bus.run(100);
    EXPECT_EQ(bus.owner(), kOld);
    EXPECT_TRUE(bus.newcomer().ended);
    EXPECT_THAT(bus.newcomer().failure, HasSubstr(reason));
    for (const auto& d : bus.heard) EXPECT_EQ(d.instance, kOld);
    EXPECT_EQ(bus.answered().size(), bus.frame);
    EXPECT_EQ(bus.notices.back().step, SwapStep::kRolledBack);
    EXPECT_EQ(bus.notices.back().reason, reason);
  }
}

TEST(Swap, NonsenseOnProbationIsRolledBackWithinTheWindow) {
  for (const auto& [reason, answer] : nonsense()) {
    SCOPED_TRACE(reason);
    Bus bus;
    bus.runUntilTakenOver();
    bus.run(5);
    bus.newcomer().answer = answer;
    const auto turned = bus.frame;
    while (bus.owner() != kOld && bus.frame < turned + 60) bus.step();
    EXPECT_LE(bus.frame - turned, Judge::kWindow + Judge::kEnough);
    bus.run(100);
    EXPECT_EQ(bus.owner(), kOld);
    EXPECT_FALSE(bus.elder().ended);
    EXPECT_TRUE(bus.newcomer().ended);
    EXPECT_EQ(bus.notices.back().step, SwapStep::kRolledBack);
    EXPECT_EQ(bus.notices.back().reason, reason);
    EXPECT_THAT(bus.elder().swap.message(), HasSubstr(reason));
    EXPECT_EQ(bus.elder().swap.reasons().of("swap_rolled_back_" + reason), 1u);
    EXPECT_EQ(bus.answered().size(), bus.frame) << "frames that failed were answered afterwards";
  }
}

TEST(Swap, ANewcomerThatDiesOnProbationLosesNoFrameAndIsKeptDown) {
  Bus bus;
  bus.runUntilTakenOver();
  bus.run(5);
  bus.newcomer().answer = [](std::uint64_t) { return std::nullopt; };
  bus.run(100);
  EXPECT_EQ(bus.owner(), kOld);
  EXPECT_EQ(bus.answered().size(), bus.frame);
  EXPECT_EQ(bus.notices.back().reason, "silent");
  EXPECT_GT(bus.elder().strength, bus.newcomer().strength) << "should it wake";
  EXPECT_FALSE(bus.elder().ended);
}

TEST(Swap, ANewcomerThatWakesIsToldAndEnds) {
  Bus bus;
  bus.runUntilTakenOver();
  bus.newcomer().answer = [](std::uint64_t) { return std::nullopt; };
  bus.run(30);
  ASSERT_EQ(bus.owner(), kOld);
  bus.newcomer().swap.ownResult(listOf(kNew, bus.frame, kStreet), false, bus.now);
  bus.obey(kNew);
  EXPECT_TRUE(bus.newcomer().ended);
  bus.run(60);
  EXPECT_EQ(bus.owner(), kOld);
}

TEST(Swap, WithoutTheOldOneTheNewcomerIsHeardAtOnceAndAsksNobody) {
  Bus bus;
  bus.elder().ended = true;
  bus.run(150);
  EXPECT_EQ(bus.owner(), kNew);
  EXPECT_THAT(bus.steps(),
              ElementsAre(SwapStep::kRehearsing, SwapStep::kTookOver, SwapStep::kPassed));
  EXPECT_EQ(bus.answered().size(), bus.frame);
}

TEST(Swap, TheOldOneThatDiesWhileTheNewcomerRehearsesLeavesItTheTopic) {
  Bus bus;
  bus.run(8);
  bus.elder().ended = true;
  bus.run(200);
  EXPECT_EQ(bus.owner(), kNew);
  EXPECT_GE(bus.answered().size() + 4, bus.frame);
}

TEST(Swap, ALateResultOnProbationRollsBack) {
  Bus bus;
  bus.runUntilTakenOver();
  bus.newcomer().swap.ownResult(listOf(kNew, bus.frame, kStreet), false, bus.now);
  bus.obey(kNew);
  bus.run(10);
  EXPECT_EQ(bus.notices.back().reason, "late");
  EXPECT_EQ(bus.owner(), kOld);
  EXPECT_EQ(bus.answered().size(), bus.frame);
}

TEST(Swap, APassOfOneThatIsNotHeardRetiresNobody) {
  Bus bus;
  bus.run(5);
  SwapNotice lie;
  lie.instance = 99;
  lie.about = kOld;
  lie.step = SwapStep::kPassed;
  bus.elder().swap.told(lie, bus.now);
  bus.obey(kOld);
  EXPECT_FALSE(bus.elder().ended);
  EXPECT_EQ(bus.elder().swap.reasons().of("swap_passed_unheard"), 1u);
}

TEST(Swap, ANewcomerWithoutALastNoticeIsCounted) {
  Bus bus;
  bus.runUntilTakenOver();
  bus.elder().swap.tick(bus.now + std::chrono::minutes(1));
  EXPECT_EQ(bus.elder().swap.reasons().of("swap_no_last_notice"), 1u);
}

TEST(Swap, WhatASpareSaysWhileReadersLearnOfItIsSaidAgain) {
  Swap spare({kNew, "spare", 0.0, kShortLease});
  Swap::Time now{std::chrono::hours(1)};
  const auto sequences = [&] {
    std::vector<std::uint64_t> all;
    for (const Detections& d : spare.take().again) all.push_back(d.stamp.sequence);
    return all;
  };
  for (std::uint64_t k = 0; k < 6; ++k, now += kPeriod) {
    spare.ownResult(listOf(kNew, k, kStreet), true, now);
    if (k < 2) spare.heard(listOf(kOld, k, kStreet), now);
    if (k >= 4) spare.heard(listOf(kNew, k, kStreet), now);  // the owner ended after frame 1
    const std::vector<std::uint64_t> missed = {2, 3};
    EXPECT_EQ(sequences(), k == 4 ? missed : std::vector<std::uint64_t>{}) << k;
  }
  spare.tick(now);
  EXPECT_THAT(sequences(), ElementsAre(2, 3, 4, 5)) << "other readers may have heard none of them";
  spare.tick(now + kShortLease);
  EXPECT_THAT(sequences(), ElementsAre());
}

TEST(Swap, WhatASpareMadeBeforeItHeardItselfIsSaidAgainToo) {
  Swap spare({kNew, "spare", 0.0, kShortLease});
  Swap::Time now{std::chrono::hours(1)};
  spare.ownResult(listOf(kNew, 0, kStreet), true, now);
  spare.heard(listOf(kOld, 0, kStreet), now);
  for (std::uint64_t k = 1; k < 4; ++k) {
    spare.ownResult(listOf(kNew, k, kStreet), true, now += kPeriod);
  }
  spare.heard(listOf(kNew, 2, kStreet), now);  // this result arrives after frame 3 was written
  (void)spare.take();
  spare.tick(now + kShortLease);
  const auto said = spare.take().again;
  EXPECT_TRUE(std::any_of(said.begin(), said.end(), [](const Detections& d) {
    return d.stamp.sequence == 2;
  })) << "others may have heard it from nobody";
}

TEST(Swap, AFrameThatIsSaidAgainIsJudgedOnce) {
  Bus bus;
  bus.runUntilTakenOver();
  bus.run(3);
  const Detections empty = listOf(kNew, bus.frame - 1, {});
  for (std::size_t i = 0; i < 2 * Judge::kEnough; ++i) {
    bus.elder().swap.heard(empty, bus.now);
    bus.obey(kOld);
  }
  EXPECT_EQ(bus.owner(), kNew);
}

TEST(Swap, ReasonsFromOutsideAreCountedTogether) {
  Bus bus;
  for (int i = 0; i < 100; ++i) {
    SwapNotice notice;
    notice.instance = 99;
    notice.about = kOld;
    notice.step = SwapStep::kTookOver;
    bus.elder().swap.told(notice, bus.now);
    notice.step = SwapStep::kRolledBack;
    notice.about = 0;
    notice.reason = "word" + std::to_string(i);
    bus.elder().swap.told(notice, bus.now);
  }
  EXPECT_EQ(bus.elder().swap.reasons().all().size(), 1u);
  EXPECT_EQ(bus.elder().swap.reasons().of("swap_rolled_back_other"), 100u);
}

TEST(Swap, OtherClassesAreNoNonsense) {
  Bus bus;
  bus.setClasses({"car", "person"}, {"bench", "hydrant"});
  bus.newcomer().answer = sees(kNew, {boxAt(600, 4)});
  bus.run(200);
  EXPECT_EQ(bus.owner(), kNew) << "it cannot know cars";
  EXPECT_TRUE(bus.elder().ended);
}

TEST(Swap, ABlindOldOneIsNoMeasure) {
  Bus bus;
  bus.elder().answer = sees(kOld, {});
  bus.run(200);
  EXPECT_EQ(bus.owner(), kNew) << "boxes where the old one sees none are no flood";
}

}  // namespace
}  // namespace perdure::inference
