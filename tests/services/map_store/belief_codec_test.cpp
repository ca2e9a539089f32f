#include "services/map_store/core/belief_codec.h"

#include <gtest/gtest.h>

#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store {
namespace {

using test::carAt;

TEST(BeliefCodec, GivesBackEveryBitOfABelief) {
  ObjectBelief belief = carAt(0xfedcba9876543210u, {1.5, -2.25, 0.1});
  belief.blocked_by = 5;
  belief.visibility = Visibility::kBehind;
  belief.memory = Memory::kLongTerm;
  belief.recalled = true;
  belief.seen_from[15] = 12.5F;
  belief.moving = 0.2;
  belief.velocity = {0.1, -7.0, 3.0};
  belief.visible_misses = 3;
  const auto back = decodeBelief(encodeBelief(belief));
  ASSERT_TRUE(back.has_value()) << back.error().detail;
  EXPECT_EQ(encodeBelief(*back), encodeBelief(belief));
  EXPECT_EQ(back->id, belief.id);
  EXPECT_EQ(back->visibility, belief.visibility);
  EXPECT_EQ(back->blocked_by, 5u);
  EXPECT_EQ(back->memory, Memory::kLongTerm);
  EXPECT_TRUE(back->recalled);
  EXPECT_EQ(back->seen_from, belief.seen_from);
  EXPECT_EQ(back->velocity, belief.velocity);
  EXPECT_EQ(back->last_seen, belief.last_seen);
  ASSERT_EQ(back->classes.size(), 2u);
  EXPECT_EQ(back->classes[1].name, "other");
  EXPECT_EQ(back->classes[1].mean, belief.classes[1].mean);
  EXPECT_EQ(back->classes[1].covariance, belief.classes[1].covariance);
  EXPECT_EQ(back->classes[0].cross_pose, belief.classes[0].cross_pose);
  EXPECT_EQ(back->why, belief.why);
}

TEST(BeliefCodec, ReadsTheFormatWithoutLedgers) {
  ObjectBelief belief = carAt(4, {1, 2, 3});
  belief.why = {};
  Bytes bytes = encodeBelief(belief);
  bytes[0] = 1;
  bytes.resize(bytes.size() - 3 * sizeof(std::uint32_t) -
               16 * sizeof(float));  // three empty lists, directions
  const auto back = decodeBelief(bytes);
  ASSERT_TRUE(back.has_value()) << back.error().detail;
  EXPECT_TRUE(back->why.empty());
  EXPECT_EQ(encodeBelief(*back), encodeBelief(belief));
  bytes.push_back(0);
  EXPECT_FALSE(decodeBelief(bytes).has_value());
}

TEST(BeliefCodec, ReadsHeadersWithoutThePoseError) {
  Objects objects = test::workingSet(9, {carAt(4, {1, 2, 3})});
  objects.pose_error.setIdentity();
  Bytes header = encodeHeader(objects);
  header.resize(header.size() - 36 * sizeof(double));
  for (const std::uint8_t version : {1, 2}) {
    header[0] = version;
    const auto back = decodeHeader(header);
    ASSERT_TRUE(back.has_value()) << back.error().detail;
    EXPECT_EQ(back->next_id, 5u);
    EXPECT_TRUE(back->pose_error.isZero(0.0));
  }
  header[0] = 3;
  EXPECT_FALSE(decodeHeader(header).has_value());
}

TEST(BeliefCodec, ReadsBeliefsOfFormatsWithoutDirections) {
  const ObjectBelief belief = carAt(4, {1, 2, 3});
  Bytes bytes = encodeBelief(belief);
  bytes.resize(bytes.size() - 16 * sizeof(float));
  for (const std::uint8_t version : {2, 3}) {
    bytes[0] = version;
    const auto back = decodeBelief(bytes);
    ASSERT_TRUE(back.has_value()) << back.error().detail;
    EXPECT_EQ(encodeBelief(*back), encodeBelief(belief));
    EXPECT_TRUE(back->seen_from.isZero(0.0F));
  }
}

TEST(BeliefCodec, RefusesALedgerThatClaimsMoreThanThereIs) {
  ObjectBelief belief = carAt(4, {1, 2, 3});
  belief.why = {};
  Bytes bytes = encodeBelief(belief);
  for (int i = 1; i <= 4; ++i)
    bytes[bytes.size() - 8 - 16 * sizeof(float) - static_cast<std::size_t>(i)] = 0xff;
  EXPECT_EQ(decodeBelief(bytes).error().code, "belief_malformed");
}

TEST(BeliefCodec, GivesBackEveryBitOfAHeader) {
  Objects objects = test::workingSet(9, {carAt(4, {0, 0, 0})});
  objects.T_WB = RigidTransform(Eigen::Quaterniond(0.5, 0.1, -0.3, 0.7), {4, 5, 6});
  objects.up_W = {0.01, 0.02, 0.9997};
  objects.pose_error(3, 2) = 0.125;
  const auto back = decodeHeader(encodeHeader(objects));
  ASSERT_TRUE(back.has_value());
  EXPECT_TRUE(back->stamp.sameFrame(objects.stamp));
  EXPECT_EQ(back->stamp.time, objects.stamp.time);
  EXPECT_EQ(back->world, objects.world);
  EXPECT_EQ(back->T_WB.q.coeffs(), objects.T_WB.q.coeffs());
  EXPECT_EQ(back->T_WB.p, objects.T_WB.p);
  EXPECT_EQ(back->up_W, objects.up_W);
  EXPECT_EQ(back->next_id, 5u);
  EXPECT_EQ(back->pose_error, objects.pose_error);
  EXPECT_TRUE(back->objects.empty());
}

TEST(BeliefCodec, WritesItsVersionAndIdLittleEndian) {
  const Bytes bytes = encodeBelief(carAt(0x0102030405060708u, {0, 0, 0}));
  const Bytes head(bytes.begin(), bytes.begin() + 10);
  EXPECT_EQ(head, (Bytes{4, 0, 8, 7, 6, 5, 4, 3, 2, 1}));
}

TEST(BeliefCodec, RefusesEveryTruncation) {
  const Bytes bytes = encodeBelief(carAt(3, {1, 2, 3}));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const auto back = decodeBelief(std::span(bytes).first(size));
    ASSERT_FALSE(back.has_value()) << "of " << size << " bytes";
    EXPECT_EQ(back.error().code, "belief_malformed");
  }
}

TEST(BeliefCodec, RefusesLeftOverBytesOtherVersionsAndNoClass) {
  Bytes longer = encodeBelief(carAt(3, {1, 2, 3}));
  longer.push_back(0);
  EXPECT_FALSE(decodeBelief(longer).has_value());
  Bytes newer = encodeBelief(carAt(3, {1, 2, 3}));
  newer[0] = 5;
  EXPECT_FALSE(decodeBelief(newer).has_value());
  ObjectBelief nothing = carAt(3, {1, 2, 3});
  nothing.classes.clear();
  EXPECT_FALSE(decodeBelief(encodeBelief(nothing)).has_value());
}

TEST(BeliefCodec, RefusesATimeThatNoMessageCanCarry) {
  ObjectBelief belief = carAt(3, {1, 2, 3});
  belief.last_seen = TimePoint::max();
  const auto back = decodeBelief(encodeBelief(belief));
  ASSERT_FALSE(back.has_value());
  EXPECT_EQ(back.error().code, "belief_malformed");
}

TEST(BeliefCodec, SurvivesRandomBytes) {
  std::mt19937 random(1);
  const Bytes sound = encodeBelief(carAt(3, {1, 2, 3}));
  int refused = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    Bytes bytes = sound;
    for (int i = 0; i < 8; ++i)
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    bytes.resize(bytes.size() - random() % 4);
    if (!decodeBelief(bytes)) ++refused;
  }
  EXPECT_GT(refused, 10000);
}

}  // namespace
}  // namespace perdure::map_store
