// The sums of the ledger equal the belief in every published frame, whatever happened before.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::detect;
using testing::detectionsAt;
using testing::Harness;
using testing::makeState;
using testing::odometryAt;
using testing::TrueObject;

constexpr double kTolerance = 1e-6;

/// Causes that occurred, over all runs.
struct Met {
  std::set<std::string> existence, classes;
  std::size_t beliefs = 0;
};

void expectSumsOf(const ObjectBelief& o, Met& met) {
  ++met.beliefs;
  ASSERT_EQ(o.why.existence.size(), kOwnExistence);
  ASSERT_NEAR(o.why.logOdds(), std::log(o.existence / (1.0 - o.existence)), kTolerance);
  for (std::size_t i = 0; i < kOwnExistence; ++i) {
    const LedgerEntry& entry = o.why.existence[i];
    ASSERT_LE(entry.first, entry.last);
    if (entry.count > 0) met.existence.insert(nameOf(static_cast<ExistenceEvidence>(i)));
  }
  ASSERT_EQ(o.why.classes.size(), o.classes.size());
  for (const ClassBelief& c : o.classes) {
    const auto row = std::find_if(o.why.classes.begin(), o.why.classes.end(),
                                  [&](const auto& r) { return r.name == c.name; });
    ASSERT_NE(row, o.why.classes.end());
    ASSERT_EQ(row->log_odds.size(), kOwnClass);
    double sum = 0.0;
    for (std::size_t i = 0; i < kOwnClass; ++i) {
      sum += row->log_odds[i];
      if (row->log_odds[i] != 0.0) met.classes.insert(nameOf(static_cast<ClassEvidence>(i)));
    }
    ASSERT_NEAR(sum, std::log(c.probability), kTolerance);
  }
}

TrueObject anyObject(std::mt19937& random) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const double x = 12.0 + 40.0 * u(random), y = -9.0 + 18.0 * u(random), yaw = 6.28 * u(random);
  switch (random() % 4) {
    case 0:
      return {makeState(x, y, 0.45, yaw, 0.5, 0.5, 0.9), "chair"};
    case 1:
      return {makeState(x, y, 1.05, yaw, 5.0, 1.9, 2.1), "van"};
    default:
      return {makeState(x, y, 0.75, yaw, 4.2, 1.75, 1.5), "car"};
  }
}

/// A world with all kinds of events. Objects drive off and stop. Boxes are missed, doubled, of
/// another class, or false. The camera turns away, detections are late or lost, and the filter
/// restarts.
class Restless {
 public:
  explicit Restless(std::uint32_t seed) : random_(seed) {
    Config config;
    config.filter.initiation.min_log_ratio = -1.0;
    priors_ = testing::makePriors();
    priors_.classes[0].moving = 0.2;
    priors_.classes[0].speed_sigma = 6.0;
    config_ = config;
    for (int i = 0; i < 9; ++i) things_.push_back(anyObject(random_));
    begin();
  }

  void run(std::uint64_t frames, Met& met) {
    for (std::uint64_t k = 0; k < frames; ++k) {
      step(k);
      if (k % 60 == 45) restart(k % 120 == 45, k % 180 == 45);
      for (; audited_ < published_.size(); ++audited_) {
        for (const auto& o : published_[audited_].objects) {
          ASSERT_NO_FATAL_FAILURE(expectSumsOf(o, met)) << "object " << o.id << ", frame " << k;
        }
      }
    }
  }
  const Node& node() const { return *node_; }

 private:
  void begin() {
    node_ = std::make_unique<Node>(
        config_, priors_, 9,
        Outputs{[this](const Objects& m) { published_.push_back(m); }, {}, {}});
    node_->onCalibration(testing::calibrationOf(testing::makeCamera()));
    node_->onModel(testing::makeModelInfo());
  }

  /// The working set returns before the first frame or in it, with its ledgers or from a peer
  /// without ledgers.
  void restart(bool before_odometry, bool without_ledgers) {
    node_->flush();
    MapNear near;
    near.instance = 5;
    near.revision = 1;
    near.world = {5, 0};
    near.client = 9;
    near.next_id = published_.back().next_id;
    near.placed = published_.back().objects;
    for (auto& o : near.placed) {
      if (without_ledgers) o.why = {};
    }
    begin();
    if (before_odometry) return node_->onNear(near);
    near_ = near;
  }

  std::vector<Detection> boxesAt(const View& view) {
    std::vector<Detection> list;
    for (auto& thing : things_) {
      if (random_() % 400 == 0) thing = anyObject(random_);
      if (thing.class_name == "van") thing.x[0] += 0.3;  // vans move
      TrueObject shown = thing;
      if (random_() % 8 == 0) shown.class_name = "van";
      const auto d = detect(shown, view, BoxParameters{}, 0.7, 2.0, random_);
      if (!d || random_() % 5 == 0) continue;
      list.push_back(*d);
      if (random_() % 10 == 0) list.push_back(*d), list.back().box.x2 += 0.3 * d->box.width();
    }
    if (random_() % 3 == 0) {
      if (auto d = detect(anyObject(random_), view, BoxParameters{}, 1.0, 1.0, random_)) {
        list.push_back(*d);
      }
    }
    return list;
  }

  void step(std::uint64_t k) {
    View view;
    view.camera = &camera_;
    view.T_WB = testing::driveTo(k % 150, 0.3);
    if (k % 100 >= 85) {
      view.T_WB.q = view.T_WB.q * Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
    }
    node_->onOdometry(odometryAt(k, view.T_WB));
    if (const auto near = std::exchange(near_, std::nullopt)) node_->onNear(*near);
    const auto boxes = detectionsAt(k, boxesAt(view));
    if (random_() % 20 == 0) return;  // lost
    if (random_() % 10 == 0) {
      late_.push_back(boxes);
      return;
    }
    node_->onDetections(boxes);
    for (const auto& d : late_) node_->onDetections(d);
    late_.clear();
  }

  std::mt19937 random_;
  Config config_;
  ClassPriors priors_;
  const CameraModel camera_{testing::makeCamera()};
  std::vector<TrueObject> things_;
  std::vector<Detections> late_;
  std::vector<Objects> published_;
  std::size_t audited_ = 0;
  std::unique_ptr<Node> node_;
  std::optional<MapNear> near_;  ///< message for the next frame
};

TEST(NodeLedger, SumsAreTheBeliefInEveryFrame) {
  Met met;
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    Restless world(seed);
    ASSERT_NO_FATAL_FAILURE(world.run(400, met)) << "seed " << seed;
    EXPECT_EQ(world.node().reasons().of("object_numbers_bad"), 0U);
  }
  EXPECT_GT(met.beliefs, 5000U);
  // If a cause did not occur in any run, the test proves nothing about it.
  for (std::size_t i = 0; i < kOwnExistence; ++i) {
    const char* name = nameOf(static_cast<ExistenceEvidence>(i));
    EXPECT_TRUE(met.existence.contains(name)) << name;
  }
  for (std::size_t i = 0; i < kOwnClass; ++i) {
    // Only earlier versions have this cause.
    if (static_cast<ClassEvidence>(i) == ClassEvidence::kContext) continue;
    const char* name = nameOf(static_cast<ClassEvidence>(i));
    EXPECT_TRUE(met.classes.contains(name)) << name;
  }
}

TEST(NodeLedger, UnusedFramesAreCountedWhenTheObjectIsNextVisible) {
  const TrueObject car{makeState(18, 3.5, 0.75, 0.1, 4.3, 1.75, 1.5), "car"};
  const CameraModel camera{testing::makeCamera()};
  Harness h;
  std::mt19937 random(4);
  const auto look = [&](std::uint64_t k, bool away) {
    View view;
    view.camera = &camera;
    view.T_WB = testing::driveTo(k, 0.1);
    if (away) view.T_WB.q = view.T_WB.q * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ());
    std::vector<Detection> boxes;
    if (const auto d = detect(car, view, BoxParameters{}, 0.5, 3.0, random)) boxes.push_back(*d);
    h.node.onOdometry(odometryAt(k, view.T_WB));
    h.node.onDetections(detectionsAt(k, boxes));
    return h.objects.back().objects.front().why;
  };
  Ledger before, hidden;
  for (std::uint64_t k = 0; k < 20; ++k) before = look(k, false);
  for (std::uint64_t k = 20; k < 50; ++k) hidden = look(k, true);
  EXPECT_EQ(before, hidden);  // the ledger of an invisible track does not change by a bit, nor does
                              // its belief
  const Ledger after = look(50, false);
  const LedgerEntry& away = after.existence[static_cast<std::size_t>(ExistenceEvidence::kAway)];
  EXPECT_EQ(away.count, 30U);
  EXPECT_EQ(away.log_odds, 0.0);
  EXPECT_EQ(away.first, testing::stampOf(20).time);
  EXPECT_EQ(away.last, testing::stampOf(49).time);
}

}  // namespace
}  // namespace perdure::semantic_filter
