// A swap of inference. A new process that detects nothing does not lower the existence of tracks.
// One that correctly detects nothing is accepted in the end.
#include <gtest/gtest.h>

#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::detect;
using testing::detectionsAt;
using testing::driveTo;
using testing::Harness;
using testing::makeState;
using testing::odometryAt;
using testing::TrueObject;

constexpr InstanceId kOldModel = 3, kNewModel = 4;
constexpr std::uint64_t kSwapAt = 20;
constexpr double kSure = 0.95, kDoubtful = 0.75;  // existence

const std::vector<TrueObject> kParked = {{makeState(14, 3.5, 0.75, 0.1, 4.3, 1.75, 1.5), "car"},
                                         {makeState(16, -4.0, 0.75, 3.0, 4.0, 1.7, 1.45), "car"},
                                         {makeState(24, 5.0, 0.75, 0.0, 4.4, 1.8, 1.5), "car"}};

/// The body is slower after the swap, so that all objects stay in view.
RigidTransform bodyAt(std::uint64_t k) {
  const auto fast = static_cast<double>(std::min(k, kSwapAt));
  return driveTo(1, 0.3 * fast + 0.1 * (static_cast<double>(k) - fast));
}

Detections look(std::uint64_t k, const std::vector<TrueObject>& objects, InstanceId who) {
  static const CameraModel camera{testing::makeCamera()};
  std::mt19937 random(static_cast<std::uint32_t>(1000 + k));
  View view;
  view.camera = &camera;
  view.T_WB = bodyAt(k);
  std::vector<Detection> list;
  for (const auto& o : objects) {
    if (auto d = detect(o, view, BoxParameters{}, 0.5, 3.0, random)) list.push_back(*d);
  }
  Detections detections = detectionsAt(k, std::move(list));
  detections.instance = who;
  return detections;
}

SwapNotice notice(SwapStep step, InstanceId who, InstanceId about) {
  SwapNotice n;
  n.instance = who;
  n.about = about;
  n.step = step;
  n.probation_s = 30.0;
  n.model = "newcomer";
  n.reason = "empty";
  return n;
}

struct Watch : Harness {
  std::uint64_t next = 0;

  void frames(std::uint64_t n, const std::vector<TrueObject>& seen, InstanceId who) {
    for (std::uint64_t i = 0; i < n; ++i, ++next) {
      node.onOdometry(odometryAt(next, bodyAt(next)));
      node.onDetections(look(next, seen, who));
    }
  }
  /// Twenty frames from the old process, then the new one takes over.
  explicit Watch(bool told = true) {
    frames(kSwapAt, kParked, kOldModel);
    if (told) node.onSwap(notice(SwapStep::kTookOver, kNewModel, kOldModel));
  }
  /// Existence of confirmed tracks, by id.
  std::map<ObjectId, double> confirmed() const {
    std::map<ObjectId, double> all;
    for (const Track& o : node.belief().tracks) {
      if (o.life.confirmed) all[o.id] = o.existence;
    }
    return all;
  }
};

TEST(Probation, ABlindNewProcessThatIsRolledBackCostsNothing) {
  Watch w;
  const auto before = w.confirmed();
  ASSERT_EQ(before.size(), 3U);
  w.frames(12, {}, kNewModel);
  EXPECT_EQ(w.objects.back().stamp.sequence, w.next - 1) << "frames are published on time";
  for (const auto& [id, existence] : before) {
    ASSERT_TRUE(w.confirmed().contains(id));
    EXPECT_GT(existence, kSure);
    EXPECT_NEAR(w.confirmed().at(id), existence, 0.02);
  }
  w.node.onSwap(notice(SwapStep::kRolledBack, kOldModel, kNewModel));
  EXPECT_EQ(w.node.reasons().of("detections_in_doubt"), 12U);
  EXPECT_EQ(w.node.reasons().of("detections_rolled_back"), 12U);
  w.frames(3, kParked, kOldModel);
  for (const auto& [id, existence] : before) EXPECT_TRUE(w.confirmed().contains(id));
  EXPECT_EQ(w.confirmed().size(), before.size()) << "nothing was initiated a second time";
}

/// The result of the other tests if no detections were delayed.
TEST(Probation, WithoutASwapAsManyEmptyFramesLowerExistence) {
  Watch w(false);
  ASSERT_EQ(w.confirmed().size(), 3U);
  w.frames(12, {}, kNewModel);
  for (const auto& [id, existence] : w.confirmed()) EXPECT_LT(existence, kDoubtful);
}

TEST(Probation, BoxesElsewhereAreHeldBackAndInitiateNothing) {
  Watch w;
  const std::vector<TrueObject> elsewhere = {
      {makeState(12, 0.2, 0.75, 0.1, 4.3, 1.75, 1.5), "car"}};
  w.frames(12, elsewhere, kNewModel);
  w.node.onSwap(notice(SwapStep::kRolledBack, kNewModel, 0));  // the new process ended without an
                                                               // external cause
  EXPECT_EQ(w.confirmed().size(), 3U);
  EXPECT_EQ(w.node.belief().tracks.size(), 3U);
}

TEST(Probation, RemovedObjectsAreDeletedWhenTheNewProcessHasPassed) {
  Watch w, plain(false);
  w.frames(12, {}, kNewModel), plain.frames(12, {}, kNewModel);
  w.node.onSwap(notice(SwapStep::kPassed, kNewModel, kOldModel));
  ASSERT_EQ(w.node.belief().tracks.size(), plain.node.belief().tracks.size());
  for (std::size_t i = 0; i < w.node.belief().tracks.size(); ++i) {
    EXPECT_DOUBLE_EQ(w.node.belief().tracks[i].existence, plain.node.belief().tracks[i].existence);
  }
  EXPECT_EQ(w.node.reasons().of("detections_rolled_back"), 0U);
}

TEST(Probation, RemovedObjectsAreDeletedWhenTheOldProcessHasNotObjectedInTime) {
  Watch w;
  w.frames(Probation::kLongest, {}, kNewModel);
  EXPECT_EQ(w.confirmed().size(), 3U);
  w.frames(1, {}, kNewModel);
  for (const auto& [id, existence] : w.confirmed()) EXPECT_LT(existence, kDoubtful);
  w.frames(5, {}, kNewModel);
  EXPECT_EQ(w.node.reasons().of("detections_in_doubt"), Probation::kLongest)
      << "nothing is held back a second time";
}

TEST(Probation, AProcessThatDetectsTheOthersIsTrustedAboutTheMissingOne) {
  Watch w, plain(false);
  const std::vector<TrueObject> rest(kParked.begin() + 1, kParked.end());
  const ObjectId missing = w.confirmed().begin()->first;
  w.frames(10, rest, kNewModel), plain.frames(10, rest, kNewModel);
  EXPECT_EQ(w.node.reasons().of("detections_in_doubt"), 0U);
  ASSERT_EQ(w.node.belief().tracks.size(), plain.node.belief().tracks.size());
  const auto confirmed = w.confirmed();
  EXPECT_TRUE(!confirmed.contains(missing) || confirmed.at(missing) < kDoubtful);
}

TEST(Probation, BlindFramesBetweenOthersAreUsedWhenDetectionsResume) {
  Watch w, plain(false);
  w.frames(4, {}, kNewModel), plain.frames(4, {}, kNewModel);
  w.frames(1, kParked, kNewModel), plain.frames(1, kParked, kNewModel);
  const auto a = w.confirmed(), b = plain.confirmed();
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [id, existence] : a) EXPECT_DOUBLE_EQ(existence, b.at(id));
}

}  // namespace
}  // namespace perdure::semantic_filter
