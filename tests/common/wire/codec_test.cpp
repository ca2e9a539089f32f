#include "common/wire/codec.h"

#include <gtest/gtest.h>

#include "common/wire/json.h"
#include "tests/common/wire/all_messages.h"
#include "tests/common/wire/examples.h"

namespace perdure::wire {
namespace {

template <class T>
class Codec : public testing::Test {};

TYPED_TEST_SUITE(Codec, AllMessages);

TYPED_TEST(Codec, BringsEveryFieldThereAndBackToTheBit) {
  Arena arena;
  for (unsigned seed = 0; seed < 200; ++seed) {
    TypeParam message;
    Examples(seed).fill(message);
    typename Type<TypeParam>::Wire wire;
    const Result<void> encoded = encode(message, wire, arena);
    ASSERT_TRUE(encoded) << encoded.error().code << " " << encoded.error().detail;
    const Result<TypeParam> back = decode<TypeParam>(wire);
    ASSERT_TRUE(back) << back.error().code << " " << back.error().detail;
    ASSERT_EQ(toJson(*back), toJson(message));
  }
}

/// Converts to any type but T itself: counts the members of an aggregate.
template <class Not>
struct Any {
  template <class X>
  requires(!std::same_as<X, Not>) operator X&() const;
  template <class X>
  requires(!std::same_as<X, Not>) operator X&&() const;
};

template <class T, std::size_t... I>
constexpr bool initialisable(std::index_sequence<I...>) {
  return requires { T{(static_cast<void>(I), Any<T>{})...}; };
}

template <class T, std::size_t N = 0>
constexpr std::size_t members() {
  if constexpr (initialisable<T>(std::make_index_sequence<N + 1>())) {
    return members<T, N + 1>();
  } else {
    return N;
  }
}

/// Number of members of the domain type, corrected for members that have several names on the wire.
template <class T>
constexpr int kNamesBeyondMembers = 0;
template <>
constexpr int kNamesBeyondMembers<ObjectState> = 1;  // the key beside the object
template <>
constexpr int kNamesBeyondMembers<Event> = 2;  // three times of a return in one array

TYPED_TEST(Codec, DescribesAsManyFieldsAsTheTypeHas) {
  TypeParam message;
  Examples(1).fill(message);
  EXPECT_EQ(static_cast<int>(toJson(message).size()),
            static_cast<int>(members<TypeParam>()) + kNamesBeyondMembers<TypeParam>);
}

TYPED_TEST(Codec, ADefaultMessageIsAValueOrAReasonButNeverACrash) {
  Arena arena;
  typename Type<TypeParam>::Wire wire;
  (void)encode(TypeParam{}, wire, arena);
  typename Type<TypeParam>::Wire nothing{};
  (void)decode<TypeParam>(nothing);
}

TEST(CodecOfElements, DescribeAsManyFieldsAsTheirTypesHave) {
  Examples examples(3);
  Objects objects;
  objects.objects = {examples.belief()};
  const auto object = toJson(objects)["objects"][0];
  EXPECT_EQ(object.size(), members<ObjectBelief>());
  EXPECT_EQ(object["classes"][0].size(), members<ClassBelief>());
  objects.ended = {examples.endedTrack()};
  EXPECT_EQ(toJson(objects)["ended"][0].size(), members<EndedTrack>());
  MapNear near;
  near.members = {examples.member()};
  EXPECT_EQ(toJson(near)["members"][0].size(), members<Member>());
  Objects explained;
  explained.objects = {examples.belief()};
  Ledger& ledger = explained.objects[0].why;
  ledger.existence = {examples.ledgerEntry()};
  ledger.classes = {{"car", {1.0}}};
  ledger.ousted = {{"van", "car", examples.time(), {2.0}}};
  const auto why = toJson(explained)["objects"][0]["why"];
  EXPECT_EQ(why.size(), 3u);  // all members except logOdds() and empty(), which are functions
  EXPECT_EQ(why["existence"][0].size(), members<LedgerEntry>());
  EXPECT_EQ(why["classes"][0].size(), members<ClassLedger>());
  EXPECT_EQ(why["ousted"][0].size(), members<OustedClass>());
  Calibration calibration;
  calibration.cameras = {examples.camera()};
  calibration.imu.emplace();
  calibration.anchor.emplace();
  const auto json = toJson(calibration);
  EXPECT_EQ(json["cameras"][0].size(),
            members<CameraCalibration>() - 1 + members<CameraDeviations>());
  EXPECT_EQ(json["imu"].size(), members<ImuCalibration>());
  EXPECT_EQ(json["anchor"].size(), members<GeoAnchor>());
  Detections detections;
  detections.detections = {examples.detection()};
  EXPECT_EQ(toJson(detections)["detections"][0].size(),
            members<Detection>() + 6);  // 4 corners, 4 deviations
  Landmarks landmarks;
  landmarks.landmarks = {examples.landmark()};
  EXPECT_EQ(toJson(landmarks)["landmarks"][0].size(), members<Landmark>());
  MapTile tile;
  tile.objects = {examples.mapObject()};
  EXPECT_EQ(toJson(tile)["objects"][0].size(), members<MapObject>());
  MapReply reply;
  reply.anchors = {examples.mapAnchor()};
  reply.loops = {examples.mapLoop()};
  reply.loops[0].pairs = {{1, 2}};
  const auto graph = toJson(reply);
  EXPECT_EQ(graph["anchors"][0].size(), members<MapAnchor>());
  EXPECT_EQ(graph["loops"][0].size(), members<MapLoop>());
  EXPECT_EQ(graph["loops"][0]["pairs"][0].size(), members<MapLoopPair>());
}

TEST(CodecOfKeys, CarryTheKeyOfADisposedObject) {
  Arena arena;
  ObjectState gone;
  gone.object.id = 42;
  perdure_msg_ObjectState wire;
  (void)encode(gone, wire, arena);
  EXPECT_EQ(wire.object_id, 42u);
  perdure_msg_ObjectState key_only{};
  key_only.object_id = 43;
  EXPECT_EQ(decodeKey<ObjectState>(key_only).object.id, 43u);
}

TEST(CodecOfObjects, IsValidForAsLongAsTheValueAndTheArenaLive) {
  Arena arena;
  Examples examples(5);
  Objects big;
  examples.fill(big);
  for (int i = 0; i < 500; ++i) big.objects.push_back(examples.belief());
  perdure_msg_Objects wire;
  for (int round = 0; round < 3; ++round) {  // the arena reuses its memory
    ASSERT_TRUE(encode(big, wire, arena));
    ASSERT_EQ(toJson(*decode<Objects>(wire)), toJson(big));
  }
}

}  // namespace
}  // namespace perdure::wire
