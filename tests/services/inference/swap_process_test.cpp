// Tests `perdure inference swap` with real processes at 30 Hz, and errors of newcomers. Swap.* is
// short and has a long lease. SwapAtFullRate.* has the lease of 30 Hz and runs as a long test.
#include <gmock/gmock.h>

#include "tests/services/inference/swap_rig.h"

namespace perdure::inference {
namespace {

using namespace std::chrono_literals;
using test::Child;
using ::testing::HasSubstr;
using testing::swapNetwork;
using testing::SwapRig;

constexpr double kRate = 30.0;
constexpr int kSettled = 30;  // frames, until all answers have arrived

/// A filter and one inference process that owns the topic.
struct Drive {
  SwapRig rig;
  std::unique_ptr<Child> filter, owner;
  InstanceId owner_id = 0;

  explicit Drive(double period_s) : rig(kRate, period_s) {
    filter = rig.startFilter();
    rig.sendCalibration();
    owner = rig.start(rig.inference(rig.model(swapNetwork("first"))), "owner");
    EXPECT_TRUE(rig.modelsKnown(1)) << owner->log();
    EXPECT_TRUE(rig.sendUntil(20, [&] { return rig.objectIds().size() >= 2; })) << filter->log();
    rig.sendFrames(kSettled);
    owner_id = rig.heard();
  }
  /// Ends the process that a command started, because no other program ends it after the command.
  void endNewcomers() {
    for (const auto& [instance, h] : rig.healths()) {
      if (h.process == "inference" && static_cast<pid_t>(h.pid) != owner->pid()) {
        kill(static_cast<pid_t>(h.pid), SIGTERM);
      }
    }
  }
  ~Drive() { endNewcomers(); }
};

void expectNothingLost(SwapRig& rig, std::uint64_t first, std::uint64_t last) {
  if (rig.unanswered(first, last) > rig.droppedByNetworks()) {
    rig.sendFrames(2 * static_cast<int>(kRate));  // Health is sent once a second
  }
  EXPECT_LE(rig.unanswered(first, last), rig.droppedByNetworks()) << rig.story(first, last);
  for (std::uint64_t k = first; k < last; ++k) {
    const auto it = rig.objectMessages().find(k);
    EXPECT_EQ(it == rig.objectMessages().end() ? 0 : it->second, 1) << "objects of frame " << k;
  }
}

TEST(Swap, OnCommandTakesOverWithoutLosingAFrameAndTheOldOneRetires) {
  Drive d(0.1);
  const auto ids = d.rig.objectIds();
  const auto first = d.rig.next();
  const auto command = d.rig.swap(d.rig.model(swapNetwork("second")), 1.0, "swap");
  ASSERT_TRUE(d.rig.sendUntil(30, [&] { return command->wait(0ms) >= 0; })) << command->log();
  EXPECT_EQ(command->wait(0ms), 0) << command->log();
  EXPECT_THAT(command->log(), HasSubstr("retires"));
  d.rig.sendFrames(kSettled);
  EXPECT_EQ(d.owner->wait(5s), 0) << d.owner->log();
  EXPECT_NE(d.rig.heard(), d.owner_id);
  expectNothingLost(d.rig, first, d.rig.next() - kSettled / 2);
  EXPECT_EQ(d.rig.objectIds(), ids);
  EXPECT_TRUE(d.rig.happened("second instead of first"));
}

/// Returns the probability of each class of an object, by name.
std::map<std::string, double> pmfOf(const ObjectBelief& object) {
  std::map<std::string, double> pmf;
  for (const ClassBelief& c : object.classes) pmf[c.name] = c.probability;
  return pmf;
}

TEST(Swap, ToANetworkOfOtherClassesObjectsKeepIdsAndClassesByName) {
  Drive d(0.1);
  const auto before = d.rig.objects();
  ASSERT_GE(before.objects.size(), 2U);
  testing::TinyOnnx other = swapNetwork("other");  // the car is its third class, and a lamp is new
  other.classes_json = R"(["person", "lamp", "car"])";
  other.logits = {0.0F, -2.0F, -1.0F, 5.0F};
  const auto command = d.rig.swap(d.rig.model(other), 1.0, "swap");
  ASSERT_TRUE(d.rig.sendUntil(30, [&] { return command->wait(0ms) >= 0; })) << command->log();
  EXPECT_EQ(command->wait(0ms), 0) << command->log();
  d.rig.sendFrames(kSettled);
  EXPECT_NE(d.rig.heard(), d.owner_id);
  EXPECT_TRUE(d.rig.happened("other instead of first; new classes: lamp"));
  for (const ObjectBelief& old : before.objects) {
    if (old.hits < 2) continue;  // as in SwapRig::objectIds
    const auto& now = d.rig.objects().objects;
    const auto same =
        std::find_if(now.begin(), now.end(), [&](const auto& o) { return o.id == old.id; });
    ASSERT_NE(same, now.end()) << "object " << old.id << " is gone";
    EXPECT_EQ(same->best().name, old.best().name);
    EXPECT_NEAR(pmfOf(*same)["car"], pmfOf(old)["car"], 0.1);
    EXPECT_LT(pmfOf(*same)["lamp"], 0.1) << "it enters at its prior, and the network denies it";
  }
}

TEST(Swap, ANewcomerThatGoesBlindOnProbationIsRolledBack) {
  Drive d(0.1);
  const auto ids = d.rig.objectIds();
  const auto first = d.rig.next();
  const auto command = d.rig.swap(d.rig.model(swapNetwork("blind", "empty")), 20.0, "swap");
  ASSERT_TRUE(d.rig.sendUntil(20, [&] { return d.rig.heard() != d.owner_id; })) << command->log();
  d.rig.sendFrames(5);
  d.rig.bright = true;
  EXPECT_TRUE(d.rig.sendUntil(10, [&] { return d.rig.heard() == d.owner_id; }));
  EXPECT_TRUE(d.rig.sendUntil(10, [&] { return command->wait(0ms) >= 0; }));
  EXPECT_EQ(command->wait(0ms), 1) << command->log();
  EXPECT_THAT(command->log(), HasSubstr("empty"));
  d.rig.sendFrames(2 * kSettled);
  EXPECT_EQ(d.rig.heard(), d.owner_id);
  EXPECT_TRUE(d.rig.happened("blind was rolled back, empty"));
  const Health& health = d.rig.healths().at(d.owner_id);
  EXPECT_THAT(health.message, HasSubstr("blind was rolled back, empty"));
  EXPECT_EQ(health.reasons.count("swap_rolled_back_empty"), 1u);
  expectNothingLost(d.rig, first, d.rig.next() - kSettled / 2);
  EXPECT_EQ(d.rig.objectIds(), ids) << "what the blind one missed was not taken for gone";
  EXPECT_GT(d.rig.healthOf("semantic_filter").reasons.count("detections_rolled_back"), 0U);
}

TEST(Swap, AStrangersServiceIsHeardAndWhenItDiesTheOldOneIs) {
  Drive d(0.1);
  const auto programs = test::programs();
  const auto stub = d.rig.start({"/bin/sh", "-c",
                                 "eval \"$(" + (programs / "perdure").string() +
                                     " env)\" && exec " + (programs / "inference_stub").string()},
                                "stub");
  d.rig.bright = true;
  constexpr InstanceId kStub = 0x57ab;
  ASSERT_TRUE(d.rig.sendUntil(20, [&] { return d.rig.heard() == kStub; })) << stub->log();
  d.rig.sendFrames(kSettled);
  EXPECT_EQ(d.rig.heard(), kStub);
  EXPECT_TRUE(d.rig.happened("stub instead of first; new classes: lamp"));
  const auto hit = d.rig.next();
  stub->signal(SIGKILL);
  d.rig.sendFrames(2 * kSettled);
  EXPECT_EQ(d.rig.heard(), d.owner_id);
  const auto settled = d.rig.next() - kSettled;
  EXPECT_EQ(d.rig.unanswered(hit, settled), 0) << d.rig.story(hit, settled);
}

class SwapAtFullRate : public ::testing::Test {
 protected:
  Drive d{1.0 / kRate};
};

TEST_F(SwapAtFullRate, TenTimesNoFrameIsLostAndNoObject) {
  const auto ids = d.rig.objectIds();
  const auto first = d.rig.next();
  for (int i = 0; i < 10; ++i) {
    const auto before = d.rig.heard();
    const std::string name = "model" + std::to_string(i);
    const auto command = d.rig.swap(d.rig.model(swapNetwork(name)), 1.0, name);
    ASSERT_TRUE(d.rig.sendUntil(30, [&] { return command->wait(0ms) >= 0; })) << command->log();
    ASSERT_EQ(command->wait(0ms), 0) << command->log();
    d.rig.sendFrames(kSettled);
    EXPECT_NE(d.rig.heard(), before);
  }
  const auto last = d.rig.next() - kSettled / 2;
  expectNothingLost(d.rig, first, last);
  EXPECT_EQ(d.rig.objectIds(), ids);
  std::printf(
      "ten swaps: %d frames, %d without detections, %d dropped by busy networks, "
      "the longest wait %d periods, %d messages repeated\n",
      static_cast<int>(last - first), d.rig.unanswered(first, last), d.rig.droppedByNetworks(),
      d.rig.longestWait(first, last), d.rig.repeated(first, last));
}

TEST_F(SwapAtFullRate, NonsenseFromTheStartIsNeverHeard) {
  for (const std::string kind : {"nan", "empty", "elsewhere"}) {
    SCOPED_TRACE(kind);
    d.rig.forgetNotices();
    d.rig.bright = false;
    d.rig.sendFrames(kSettled);
    d.rig.bright = true;
    const auto first = d.rig.next();
    const auto command = d.rig.swap(d.rig.model(swapNetwork(kind, kind)), 20.0, kind);
    ASSERT_TRUE(d.rig.sendUntil(30, [&] { return command->wait(0ms) >= 0; })) << command->log();
    EXPECT_EQ(command->wait(0ms), 1) << command->log();
    d.rig.sendFrames(kSettled);
    EXPECT_THAT(d.rig.answerers(first, d.rig.next()), ::testing::ElementsAre(d.owner_id));
    EXPECT_TRUE(d.rig.happened(kind + " was rolled back, " + (kind == "nan" ? "fails" : kind)));
    expectNothingLost(d.rig, first, d.rig.next() - kSettled / 2);
  }
}

TEST_F(SwapAtFullRate, NonsenseOnProbationIsRolledBack) {
  for (const std::string kind : {"nan", "empty", "elsewhere"}) {
    SCOPED_TRACE(kind);
    d.rig.forgetNotices();
    d.rig.bright = false;
    d.rig.sendFrames(kSettled);
    const auto first = d.rig.next();
    const auto command = d.rig.swap(d.rig.model(swapNetwork(kind, kind)), 20.0, kind);
    ASSERT_TRUE(d.rig.sendUntil(20, [&] { return d.rig.heard() != d.owner_id; })) << command->log();
    d.rig.sendFrames(5);
    d.rig.bright = true;
    const auto turned = d.rig.next();
    ASSERT_TRUE(d.rig.sendUntil(20, [&] { return command->wait(0ms) >= 0; })) << command->log();
    EXPECT_EQ(command->wait(0ms), 1) << command->log();
    const auto over = d.rig.next();
    d.rig.sendFrames(kSettled);
    EXPECT_EQ(d.rig.heard(), d.owner_id);
    EXPECT_TRUE(d.rig.happened(kind + " was rolled back, " + (kind == "nan" ? "fails" : kind)));
    expectNothingLost(d.rig, first, d.rig.next() - kSettled / 2);
    std::printf("%s: rolled back and told within %d frames\n", kind.c_str(),
                static_cast<int>(over - turned));
  }
}

TEST_F(SwapAtFullRate, ANewcomerThatIsKilledOrStoppedOnProbationIsRolledBack) {
  for (const int number : {SIGKILL, SIGSTOP}) {
    SCOPED_TRACE(number);
    d.rig.forgetNotices();
    const auto newcomer =
        d.rig.start(d.rig.inference(d.rig.model(swapNetwork("s" + std::to_string(number))),
                                    {"ownership.probation_s=20"}),
                    "newcomer" + std::to_string(number));
    ASSERT_TRUE(d.rig.sendUntil(20, [&] { return d.rig.heard() != d.owner_id; }))
        << newcomer->log();
    const InstanceId fresh = d.rig.heard();
    d.rig.sendFrames(10);
    const auto hit = d.rig.next();
    newcomer->signal(number);
    d.rig.sendFrames(2 * kSettled);
    EXPECT_EQ(d.rig.heard(), d.owner_id);
    EXPECT_TRUE(d.rig.said(SwapStep::kRolledBack, "silent"));
    EXPECT_EQ(d.rig.unanswered(hit, d.rig.next() - kSettled), 0);
    EXPECT_LE(d.rig.longestWait(hit, d.rig.next() - kSettled), number == SIGKILL ? 4 : 6);
    const auto woken = d.rig.next();
    newcomer->signal(SIGCONT);
    d.rig.sendFrames(2 * kSettled);
    EXPECT_EQ(d.rig.answerers(woken, d.rig.next()).count(fresh), 0u) << "it took it back unasked";
    EXPECT_EQ(newcomer->wait(2s), number == SIGKILL ? 128 + SIGKILL : 1) << newcomer->log();
  }
}

TEST_F(SwapAtFullRate, ByHandTheTwoSettleItWithoutAnyCommand) {
  const auto first = d.rig.next();
  const auto newcomer = d.rig.start(
      d.rig.inference(d.rig.model(swapNetwork("hand")), {"ownership.probation_s=1"}), "newcomer");
  ASSERT_TRUE(d.rig.sendUntil(30, [&] { return d.owner->wait(0ms) == 0; })) << newcomer->log();
  d.rig.sendFrames(kSettled);
  EXPECT_NE(d.rig.heard(), d.owner_id);
  expectNothingLost(d.rig, first, d.rig.next() - kSettled / 2);
}

TEST_F(SwapAtFullRate, ACommandThatIsKilledHalfWayLeavesASwapThatEndsWell) {
  const auto first = d.rig.next();
  const auto command = d.rig.swap(d.rig.model(swapNetwork("orphan")), 2.0, "killed");
  ASSERT_TRUE(d.rig.sendUntil(20, [&] { return d.rig.said(SwapStep::kTookOver); }));
  command->signal(SIGKILL);
  ASSERT_TRUE(d.rig.sendUntil(30, [&] { return d.owner->wait(0ms) == 0; })) << d.owner->log();
  d.rig.sendFrames(kSettled);
  EXPECT_NE(d.rig.heard(), d.owner_id);
  expectNothingLost(d.rig, first, d.rig.next() - kSettled / 2);
}

TEST_F(SwapAtFullRate, ACommandThatIsInterruptedRollsBack) {
  const auto first = d.rig.next();
  const auto command = d.rig.swap(d.rig.model(swapNetwork("second")), 20.0, "interrupted");
  ASSERT_TRUE(d.rig.sendUntil(20, [&] { return d.rig.heard() != d.owner_id; }));
  command->signal(SIGINT);
  ASSERT_TRUE(d.rig.sendUntil(10, [&] { return command->wait(0ms) >= 0; }));
  EXPECT_EQ(command->wait(0ms), 1) << command->log();
  d.rig.sendFrames(kSettled);
  EXPECT_EQ(d.rig.heard(), d.owner_id);
  expectNothingLost(d.rig, first, d.rig.next() - kSettled / 2);
}

TEST_F(SwapAtFullRate, AWarmSpareAnswersTheFramesOfAnOwnerThatIsKilledOrHangs) {
  for (const int number : {SIGKILL, SIGSTOP}) {
    SCOPED_TRACE(number);
    const auto spare =
        d.rig.start(d.rig.inference(d.rig.model(swapNetwork("spare" + std::to_string(number))),
                                    {"ownership.standby=true", "ownership.strength=30"}),
                    "spare" + std::to_string(number));
    (void)spare;
    ASSERT_TRUE(d.rig.sendUntil(20, [&] { return d.rig.heard() != d.owner_id; }));
    const InstanceId before = d.rig.heard();
    d.rig.sendFrames(kSettled);
    const auto hit = d.rig.next();
    spare->signal(number);
    d.rig.sendFrames(2 * kSettled);
    EXPECT_EQ(d.rig.heard(), d.owner_id);
    const auto settled = d.rig.next() - kSettled;
    const int lost = d.rig.unanswered(hit, settled), wait = d.rig.longestWait(hit, settled);
    EXPECT_EQ(lost, 0) << d.rig.story(hit, settled);
    EXPECT_LE(wait, number == SIGKILL ? 4 : 6);
    std::printf("signal %d: %d frames without detections, the longest wait %d periods\n", number,
                lost, wait);
    const auto woken = d.rig.next();
    spare->signal(SIGCONT);
    d.rig.sendFrames(3 * kSettled);
    EXPECT_EQ(d.rig.answerers(woken, d.rig.next()).count(before), 0u);
  }
}

}  // namespace
}  // namespace perdure::inference
