#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>

#include "common/types/description.h"
#include "common/wire/codec.h"
#include "tests/common/wire/examples.h"

namespace perdure::wire {
namespace {

/// "code detail" of a message's refusal, for encoding and decoding; "" if it is accepted.
template <class T>
std::string refusal(const T& message) {
  Arena arena;
  typename Type<T>::Wire wire;
  const Result<void> encoded = encode(message, wire, arena);
  return encoded ? "" : encoded.error().code + " " + encoded.error().detail;
}

template <class T, class Change>
std::string decodeRefusal(T message, Change change) {
  Arena arena;
  typename Type<T>::Wire wire;
  if (!encode(message, wire, arena)) return "not encodable";
  change(wire);
  const Result<T> decoded = decode<T>(wire);
  return decoded ? "" : decoded.error().code + " " + decoded.error().detail;
}

template <class T>
T example(unsigned seed = 4) {
  T message;
  Examples(seed).fill(message);
  return message;
}

Detections twoDetections() {
  Examples examples(2);
  Detections message = example<Detections>();
  message.detections = {examples.detection(), examples.detection()};
  message.detections[1].activations = {0.0F, 1.0F};
  return message;
}

TEST(Refusals, NameTheReasonAndThePathOfTheField) {
  Detections message = twoDetections();
  message.detections[1].activations[1] = NAN;
  EXPECT_EQ(refusal(message), "not_finite detections[1].activations");
  message = twoDetections();
  message.detections[1].box.x1 = message.detections[1].box.x2;
  EXPECT_EQ(refusal(message), "out_of_range detections[1].box");
  message = twoDetections();
  message.camera.clear();
  EXPECT_EQ(refusal(message), "empty camera");
}

TEST(Refusals, OfInsetsThatAreNotFourAClass) {
  ModelInfo message = example<ModelInfo>();
  message.classes = {"car", "person"};
  message.side_insets = {0.04, 0.05, 0.03, 0.06, 0.1, 0.0, 0.1, -0.01};
  EXPECT_EQ(refusal(message), "");
  message.side_insets.pop_back();
  EXPECT_EQ(refusal(message), "size_mismatch side_insets");
  message.side_insets.push_back(0.6);
  EXPECT_EQ(refusal(message), "out_of_range side_insets");
  message.side_insets.clear();
  EXPECT_EQ(refusal(message), "");
}

TEST(Refusals, OfBytesThatAreNeitherTrueNorFalse) {
  const auto of = [](auto change) { return decodeRefusal(example<Odometry>(), change); };
  EXPECT_EQ(of([](auto& w) { std::memset(&w.has_increment, 1, 1); }), "");
  EXPECT_EQ(of([](auto& w) { std::memset(&w.has_increment, 255, 1); }),
            "out_of_range has_increment");
  EXPECT_EQ(decodeRefusal(example<Calibration>(), [](auto& w) { std::memset(&w.has_imu, 2, 1); }),
            "out_of_range imu");
}

TEST(Refusals, OfTimesWhoseDifferencesWouldOverflow) {
  const auto of = [](auto change) { return decodeRefusal(twoDetections(), change); };
  EXPECT_EQ(of([](auto& w) { w.stamp.time_ns = (INT64_MAX >> 1) - 1; }), "");
  EXPECT_EQ(of([](auto& w) { w.stamp.time_ns = INT64_MAX; }), "out_of_range stamp.time_ns");
  EXPECT_EQ(of([](auto& w) { w.stamp.time_ns = INT64_MIN; }), "out_of_range stamp.time_ns");
  EXPECT_EQ(of([](auto& w) { w.stamp.captured_ns = INT64_MIN; }), "out_of_range stamp.captured_ns");
  Detections message = twoDetections();
  message.stamp.time = TimePoint::max();
  EXPECT_EQ(refusal(message), "out_of_range stamp.time_ns");
}

TEST(Refusals, OfMalformedDetectionsFromOutside) {
  const auto of = [](auto change) { return decodeRefusal(twoDetections(), change); };
  EXPECT_EQ(of([](auto&) {}), "");
  EXPECT_EQ(of([](auto& w) { w.items._buffer[0].corners[2] = NAN; }),
            "not_finite detections[0].x2");
  EXPECT_EQ(of([](auto& w) { w.items._buffer[0].corners[0] = 1e300; }),
            "out_of_range detections[0].x1");
  EXPECT_EQ(of([](auto& w) { w.items._length = kDetections + 1; }), "over_bound detections");
  EXPECT_EQ(of([](auto& w) { w.items._buffer = nullptr; }), "size_mismatch detections");
  EXPECT_EQ(of([](auto& w) { w.camera = nullptr; }), "empty camera");
  std::string text = "\xff";
  EXPECT_EQ(of([&](auto& w) { w.camera = text.data(); }), "bad_text camera");
  text.assign(kNameLength + 1, 'a');
  EXPECT_EQ(of([&](auto& w) { w.camera = text.data(); }), "over_bound camera");
}

TEST(Refusals, OfImagesWhoseSizeIsNotThatOfTheirPixels) {
  const auto of = [](auto change) { return decodeRefusal(example<Frame>(), change); };
  EXPECT_EQ(of([](auto& w) { ++w.width; }), "size_mismatch pixels");
  EXPECT_EQ(of([](auto& w) { --w.pixels._length; }), "size_mismatch pixels");
  EXPECT_EQ(of([](auto& w) { w.pixels._length = 0; }), "size_mismatch pixels");
  EXPECT_EQ(of([](auto& w) { w.width = w.height = 0xffffffff; }), "out_of_range width");
  EXPECT_EQ(of([](auto& w) { w.encoding = 4; }), "bad_enum encoding");
  Frame no_pixels = example<Frame>();
  no_pixels.data = nullptr;
  EXPECT_EQ(refusal(no_pixels), "size_mismatch pixels");
}

TEST(Refusals, OfJpegsThatAreTooSmallOrTooLargeToBeTheImage) {
  const auto of = [](auto change) { return decodeRefusal(example<Frame>(), change); };
  EXPECT_EQ(of([](auto& w) { w.encoding = 3; }), "");
  EXPECT_EQ(of([](auto& w) { w.encoding = 2, --w.pixels._length; }), "");
  EXPECT_EQ(of([](auto& w) { w.encoding = 3, w.pixels._length = 3; }), "size_mismatch pixels");
  Frame large = example<Frame>();
  large.encoding = ImageEncoding::kJpegMono8;
  const std::size_t pixels = std::size_t{large.width} * large.height;
  large.data = std::make_shared<const std::vector<std::uint8_t>>(2 * pixels + 4096);
  EXPECT_EQ(refusal(large), "");
  large.data = std::make_shared<const std::vector<std::uint8_t>>(2 * pixels + 4097);
  EXPECT_EQ(refusal(large), "size_mismatch pixels");
}

TEST(Refusals, OfCovariancesThatAreNone) {
  Odometry odometry = example<Odometry>();
  odometry.covariance(8, 8) = -1;
  EXPECT_EQ(refusal(odometry), "bad_covariance covariance");
  odometry = example<Odometry>();
  odometry.covariance(0, 3) = NAN;
  EXPECT_EQ(refusal(odometry), "not_finite covariance");
  odometry = example<Odometry>();
  odometry.covariance.setZero();  // exact, as in a truth file
  EXPECT_EQ(refusal(odometry), "");
  ObjectState state = example<ObjectState>();
  state.object.classes[0].covariance.setZero();
  EXPECT_EQ(refusal(state), "bad_covariance object.classes[0].covariance");
  EXPECT_EQ(decodeRefusal(example<ObjectState>(),
                          [](auto& w) { w.belief.classes._buffer[0].covariance[1] = 1e9; }),
            "bad_covariance object.classes[0].covariance");
}

TEST(Refusals, OfPoseErrorsThatAreNone) {
  Objects objects = example<Objects>();
  objects.pose_error(2, 2) = -1;
  EXPECT_EQ(refusal(objects), "bad_covariance pose_error");
  objects.pose_error.setZero();  // zero means that the covariance is not known
  EXPECT_EQ(refusal(objects), "");
}

TEST(Refusals, OfMembersWithoutTrackOrObject) {
  MapNear near = example<MapNear>();
  near.members = {{9, 7}, {10, 8}};
  EXPECT_EQ(refusal(near), "");
  near.members[1].object = 0;
  EXPECT_EQ(refusal(near), "out_of_range members[1].object");
  near.members[1] = {0, 8};
  EXPECT_EQ(refusal(near), "out_of_range members[1].object");
}

TEST(Refusals, OfTracksThatEndedInThemselvesAndOfTooMany) {
  Objects objects = example<Objects>();
  objects.ended = {{9, 7, {}}, {10, 0, {}}};
  EXPECT_EQ(refusal(objects), "");
  objects.ended[1].into = 10;
  EXPECT_EQ(refusal(objects), "out_of_range ended[1].track");
  objects.ended[1] = {0, 8, {}};
  EXPECT_EQ(refusal(objects), "out_of_range ended[1].track");
  objects.ended.assign(kMostEnded, {9, 7, {}});
  EXPECT_EQ(refusal(objects), "");
  objects.ended.push_back({9, 7, {}});
  EXPECT_EQ(refusal(objects), "over_bound ended");
}

TEST(Refusals, OfDistancesBelowZero) {
  Objects objects = example<Objects>();
  objects.near_m = -1.0;
  EXPECT_EQ(refusal(objects), "out_of_range near_m");
  objects.near_m = 0.0;  // the map must give no objects
  EXPECT_EQ(refusal(objects), "");
}

TEST(Refusals, OfRotationsThatAreNone) {
  Odometry odometry = example<Odometry>();
  odometry.T_WB.q.coeffs() *= 1.1;
  EXPECT_EQ(refusal(odometry), "bad_rotation T_WB");
  odometry = example<Odometry>();
  odometry.up_W.setZero();
  EXPECT_EQ(refusal(odometry), "bad_rotation up_W");
}

TEST(Refusals, OfBeliefsThatAreNoProbabilities) {
  ObjectState state = example<ObjectState>();
  state.object.classes[0].probability *= 0.5;
  EXPECT_EQ(refusal(state), "bad_probabilities object.classes");
  state.object.classes.clear();
  EXPECT_EQ(refusal(state), "bad_probabilities object.classes");
  state = example<ObjectState>();
  state.object.existence = 1.5;
  EXPECT_EQ(refusal(state), "out_of_range object.existence");
  state = example<ObjectState>();
  state.object.id = 0;
  EXPECT_EQ(refusal(state), "out_of_range object.id");
}

ObjectState explained() {
  ObjectState state = example<ObjectState>();
  state.object.why.existence.assign(kExistenceEvidences, {0.5, 3, {}, fromNanoseconds(9)});
  state.object.why.classes = {{"car", std::vector<double>(kClassEvidences, -0.1)}};
  state.object.why.ousted = {{"van", "car", fromNanoseconds(9), {1.0, 2.0}}};
  return state;
}

TEST(Refusals, OfLedgersThatAreNone) {
  EXPECT_EQ(refusal(explained()), "");
  ObjectState state = explained();
  state.object.why.existence[2].log_odds = INFINITY;
  EXPECT_EQ(refusal(state), "not_finite object.why.existence[2].log_odds");
  state = explained();
  state.object.why.existence[1].first = fromNanoseconds(10);
  EXPECT_EQ(refusal(state), "out_of_range object.why.existence[1].last_ns");
  state = explained();
  state.object.why.existence.resize(kEvidenceKinds + 1, {});
  EXPECT_EQ(refusal(state), "over_bound object.why.existence");
  state = explained();
  state.object.why.classes[0].log_odds[3] = 1e10;
  EXPECT_EQ(refusal(state), "out_of_range object.why.classes[0].log_odds");
  state = explained();
  state.object.why.classes[0].name.clear();
  EXPECT_EQ(refusal(state), "empty object.why.classes[0].name");
  state = explained();
  state.object.why.ousted.push_back(state.object.why.ousted[0]);
  EXPECT_EQ(refusal(state), "over_bound object.why.ousted");
}

TEST(Refusals, AreNotForKindsOfEvidenceThatAreNotKnownYet) {
  ObjectState state = explained();
  state.object.why.existence.resize(kExistenceEvidences + 2, {0.25, 1, {}, {}});
  state.object.why.classes[0].log_odds.resize(kClassEvidences + 1, 0.5);
  Arena arena;
  perdure_msg_ObjectState wire;
  ASSERT_TRUE(encode(state, wire, arena));
  EXPECT_EQ(decode<ObjectState>(wire)->object.why, state.object.why);
}

TEST(Refusals, AreNotForWhatRoundingPutALittleOutside) {
  ObjectState state = example<ObjectState>();
  state.object.existence = 1.0 + 1e-15;
  Arena arena;
  perdure_msg_ObjectState wire;
  ASSERT_TRUE(encode(state, wire, arena));
  EXPECT_EQ(decode<ObjectState>(wire)->object.existence, 1.0);
}

TEST(Refusals, OfTwoIdsInOneState) {
  EXPECT_EQ(decodeRefusal(example<ObjectState>(), [](auto& w) { ++w.object_id; }),
            "size_mismatch id");
}

TEST(Refusals, OfEnumsOutOfRange) {
  EXPECT_EQ(decodeRefusal(example<Event>(), [](auto& w) { w.kind = 200; }), "bad_enum kind");
  EXPECT_EQ(decodeRefusal(example<MapQuery>(), [](auto& w) { w.kind = 8; }), "bad_enum kind");
  EXPECT_EQ(decodeRefusal(example<Odometry>(), [](auto& w) { w.state = 3; }), "bad_enum state");
  EXPECT_EQ(decodeRefusal(example<Health>(), [](auto& w) { w.state = 4; }), "bad_enum state");
}

TEST(Refusals, OfLoopsThatHangOnNothing) {
  Examples examples(4);
  MapReply reply;
  reply.anchors = {examples.mapAnchor()};
  reply.loops = {examples.mapLoop()};
  EXPECT_EQ(refusal(reply), "");
  EXPECT_EQ(decodeRefusal(reply, [](auto& w) { w.loops._buffer[0].state = 3; }),
            "bad_enum loops[0].state");
  reply.loops[0].b = 0;
  EXPECT_EQ(refusal(reply), "out_of_range loops[0].id");
  reply.loops.clear();
  reply.anchors[0].sigma[3] = -1;
  EXPECT_EQ(refusal(reply), "out_of_range anchors[0].sigma");
}

TEST(Refusals, OfTilesThatHoldTooMuch) {
  Examples examples(1);
  MapTile tile = example<MapTile>();
  tile.objects.assign(kMapTileCapacity, examples.mapObject());
  EXPECT_EQ(refusal(tile), "");
  tile.objects.push_back(examples.mapObject());
  EXPECT_EQ(refusal(tile), "over_bound objects");
  tile = example<MapTile>();
  tile.part = -1;
  EXPECT_EQ(refusal(tile), "out_of_range part");
}

TEST(Refusals, OfCalibrationsThatProjectNothing) {
  Examples examples(1);
  Calibration calibration;
  calibration.cameras = {examples.camera()};
  EXPECT_EQ(refusal(calibration), "");
  calibration.cameras[0].fx = 0;
  EXPECT_EQ(refusal(calibration), "out_of_range cameras[0].fx");
  calibration.cameras[0] = examples.camera();
  calibration.cameras[0].distortion_coefficients.pop_back();
  EXPECT_EQ(refusal(calibration), "size_mismatch cameras[0].distortion_coefficients");
}

}  // namespace
}  // namespace perdure::wire
