// Malformed and hostile `detections` pass the checks of the wire to the node. Each kind is counted
// by its reason, and no bit of the belief changes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "common/wire/codec.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::detectionsAt;
using testing::driveTo;
using testing::Harness;
using testing::makeState;
using testing::odometryAt;
using testing::TrueObject;
using Wire = perdure_msg_Detections;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint64_t kFrameCount = 25;

Detections truthAt(std::uint64_t k) {
  static const std::vector<TrueObject> street = {
      {makeState(18, 3.5, 0.75, 0.1, 4.3, 1.75, 1.5), "car"},
      {makeState(22, -4.0, 0.75, 3.0, 4.0, 1.7, 1.45), "car"}};
  static const CameraModel camera{testing::makeCamera()};
  std::mt19937 random(static_cast<std::uint32_t>(k) + 1);
  View view;
  view.camera = &camera;
  view.T_WB = driveTo(k, 0.4);
  std::vector<Detection> boxes;
  for (const auto& o : street) {
    if (auto d = testing::detect(o, view, BoxParameters{}, 0.5, 3.0, random)) boxes.push_back(*d);
  }
  return detectionsAt(k, boxes);
}

/// A filter behind the checks of the wire, as behind a Reader.
struct Gateway {
  Harness filter;
  ReasonCounts refused;

  void send(const Detections& message, const std::function<void(Wire&)>& damage = {}) {
    wire::Arena arena;
    Wire sample;
    ASSERT_TRUE(wire::encode(message, sample, arena));
    if (damage) damage(sample);
    if (const auto decoded = wire::decode<Detections>(sample)) {
      filter.node.onDetections(*decoded);
    } else {
      refused.add("detections_malformed_" + decoded.error().code);
    }
  }
  std::uint64_t counted(const std::string& reason) const {
    return refused.of(reason) + filter.node.reasons().of(reason);
  }
};

struct Attack {
  std::string reason;  ///< the reason under which it is counted
  std::function<void(Gateway&, std::uint64_t frame)> send;
};

Attack damaged(const std::string& reason, const std::function<void(Wire&)>& damage) {
  return {reason, [damage](Gateway& g, std::uint64_t k) { g.send(truthAt(k), damage); }};
}

/// A valid message; `change` makes it one that must be refused.
Attack sound(const std::string& reason, const std::function<void(Detections&)>& change) {
  return {reason, [change](Gateway& g, std::uint64_t k) {
            Detections d = truthAt(k);
            change(d);
            g.send(d);
          }};
}

std::vector<Attack> attacks() {
  const auto box = [](Wire& w) -> perdure_msg_Detection& { return w.items._buffer[0]; };
  static std::vector<perdure_msg_Detection> million(1'000'000);
  static std::string latin = "caf\xe9";
  return {
      damaged("detections_malformed_not_finite", [=](Wire& w) { box(w).corners[2] = kNaN; }),
      damaged("detections_malformed_not_finite", [=](Wire& w) { box(w).corners[0] = INFINITY; }),
      damaged("detections_malformed_not_finite",
              [=](Wire& w) { box(w).activations._buffer[1] = NAN; }),
      damaged("detections_malformed_not_finite",
              [=](Wire& w) { box(w).has_azimuth = true, box(w).azimuth = kNaN; }),
      damaged("detections_malformed_not_finite", [=](Wire& w) { box(w).side_sigma[3] = kNaN; }),
      damaged("detections_malformed_out_of_range",
              [=](Wire& w) { std::swap(box(w).corners[0], box(w).corners[2]); }),
      damaged("detections_malformed_out_of_range",
              [=](Wire& w) { box(w).corners[3] = box(w).corners[1]; }),
      damaged("detections_malformed_out_of_range", [=](Wire& w) { box(w).corners[2] = 1e300; }),
      damaged("detections_malformed_out_of_range", [=](Wire& w) { box(w).side_sigma[0] = -1.0; }),
      damaged("detections_malformed_out_of_range",
              [=](Wire& w) { box(w).has_azimuth = true, box(w).azimuth_sigma = 0.0; }),
      damaged("detections_malformed_over_bound",
              [](Wire& w) {
                w.items._buffer = million.data();
                w.items._length = static_cast<std::uint32_t>(million.size());
              }),
      damaged("detections_malformed_size_mismatch", [](Wire& w) { w.items._buffer = nullptr; }),
      damaged("detections_malformed_empty", [](Wire& w) { w.camera = nullptr; }),
      damaged("detections_malformed_bad_text", [](Wire& w) { w.camera = latin.data(); }),
      sound("detections_of_other_camera", [](Detections& d) { d.camera = "cam7"; }),
      sound("detections_of_unknown_model", [](Detections& d) { d.model_hash = 99; }),
      sound("detections_classes_mismatch",
            [](Detections& d) { d.detections[0].activations.push_back(9.0F); }),
      sound("detections_classes_mismatch",
            [](Detections& d) { d.detections.back().activations.clear(); }),
      sound("detections_of_the_future",
            [](Detections& d) {
              d.stamp.sequence += 100000;
              d.stamp.time += std::chrono::hours(24 * 365);
            }),
      sound("detections_too_late",
            [](Detections& d) {
              d.stamp.source = 4711;  // belongs to no frame; its time is in the past
              d.stamp.time -= std::chrono::seconds(1);
            }),
      {"detections_repeated",
       [](Gateway& g, std::uint64_t k) {
         Detections d = truthAt(k - 1);  // other detections for a frame that already has some
         d.detections.clear();
         g.send(d);
       }},
  };
}

void expectSameBits(const Belief& a, const Belief& b) {
  ASSERT_EQ(a.tracks.size(), b.tracks.size());
  ASSERT_GE(a.tracks.size(), 2u);
  for (std::size_t j = 0; j < a.tracks.size(); ++j) {
    const Track &x = a.tracks[j], &y = b.tracks[j];
    EXPECT_EQ(x.id, y.id);
    EXPECT_EQ(double(x.existence), double(y.existence));
    EXPECT_EQ(x.life.hits, y.life.hits);
    ASSERT_EQ(x.hypotheses.size(), y.hypotheses.size());
    for (std::size_t i = 0; i < x.hypotheses.size(); ++i) {
      EXPECT_EQ(x.hypotheses[i].class_name, y.hypotheses[i].class_name);
      EXPECT_EQ(x.hypotheses[i].weight, y.hypotheses[i].weight);
      EXPECT_EQ(x.hypotheses[i].x, y.hypotheses[i].x);
      EXPECT_EQ(x.hypotheses[i].P, y.hypotheses[i].P);
      EXPECT_EQ(x.hypotheses[i].C, y.hypotheses[i].C);
    }
  }
}

/// Drives with true detections; `before` may send other messages before those of each frame.
void drive(Gateway& g, const std::function<void(std::uint64_t)>& before = {}) {
  for (std::uint64_t k = 0; k < kFrameCount; ++k) {
    g.filter.node.onOdometry(odometryAt(k, driveTo(k, 0.4)));
    if (before) before(k);
    g.send(truthAt(k));
  }
}

TEST(NodeMalformedDetections, AreCountedByReasonAndLeaveTheBeliefAsItIs) {
  Gateway clean;
  drive(clean);
  for (const Attack& attack : attacks()) {
    SCOPED_TRACE(attack.reason);
    Gateway attacked;
    drive(attacked, [&](std::uint64_t k) {
      if (k >= 5 && k < 15) attack.send(attacked, k);
    });
    EXPECT_EQ(attacked.counted(attack.reason), 10u);
    std::uint64_t all = 0;
    for (const auto& [reason, n] : attacked.refused.all()) all += n;
    for (const auto& [reason, n] : attacked.filter.node.reasons().all()) all += n;
    EXPECT_EQ(all, 10u) << "and by nothing else";
    expectSameBits(clean.filter.node.belief(), attacked.filter.node.belief());
  }
}

TEST(NodeMalformedDetections, InAnyMixtureLeaveTheBeliefAsItIs) {
  Gateway clean;
  drive(clean);
  const auto all = attacks();
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    Gateway attacked;
    std::map<std::string, std::uint64_t> sent;
    drive(attacked, [&](std::uint64_t k) {
      for (std::uint32_t n = k < 2 ? 0 : random() % 5; n > 0; --n) {
        const Attack& attack = all[random() % all.size()];
        attack.send(attacked, k);
        ++sent[attack.reason];
      }
    });
    for (const auto& [reason, n] : sent) EXPECT_EQ(attacked.counted(reason), n) << reason;
    expectSameBits(clean.filter.node.belief(), attacked.filter.node.belief());
  }
}

TEST(NodeMalformedDetections, InventedStampsDoNotDisplaceDetectionsThatWaitForOdometry) {
  Gateway clean, attacked;
  drive(clean);
  for (std::uint64_t k = 0; k < kFrameCount; ++k) {
    if (k > 0) {
      attacked.send(truthAt(k));  // detections are sent before their odometry
      for (std::uint64_t i = 0; i < 40; ++i) {
        Detections d = detectionsAt(k + 1 + i, {});
        d.stamp.source = 4711;
        attacked.send(d);
      }
    }
    attacked.filter.node.onOdometry(odometryAt(k, driveTo(k, 0.4)));
    if (k == 0) attacked.send(truthAt(k));
  }
  EXPECT_GT(attacked.counted("detections_without_odometry"), 500u);
  expectSameBits(clean.filter.node.belief(), attacked.filter.node.belief());
}

TEST(NodeMalformedDetections, AModelThatContradictsItsHashIsRefused) {
  Gateway clean, attacked;
  drive(clean);
  ModelInfo liar = testing::makeModelInfo();
  std::reverse(liar.classes.begin(), liar.classes.end());
  drive(attacked, [&](std::uint64_t) { attacked.filter.node.onModel(liar); });
  EXPECT_EQ(attacked.counted("model_contradicts_its_hash"), kFrameCount);
  expectSameBits(clean.filter.node.belief(), attacked.filter.node.belief());
}

TEST(NodeMalformedDetections, AThousandUnknownModelsDoNotDisplaceTheOneInUse) {
  Gateway clean, attacked;
  drive(clean);
  drive(attacked, [&](std::uint64_t k) {
    ModelInfo stranger = testing::makeModelInfo();
    for (std::uint64_t i = 0; k > 0 && i < 40; ++i) {
      stranger.hash = 1000 + 40 * k + i;
      attacked.filter.node.onModel(stranger);
    }
  });
  expectSameBits(clean.filter.node.belief(), attacked.filter.node.belief());
}

}  // namespace
}  // namespace perdure::semantic_filter
