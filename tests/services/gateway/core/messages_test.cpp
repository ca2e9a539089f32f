// Reads the outgoing messages again: scene, beliefs, annotations, poses, health.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "services/gateway/core/annotations.h"
#include "services/gateway/core/beliefs.h"
#include "services/gateway/core/channels.h"
#include "services/gateway/core/scene.h"
#include "services/gateway/core/vital_signs.h"
#include "services/gateway/core/world.h"
#include "tests/services/gateway/objects.h"

namespace perdure::gateway {
namespace {

using nlohmann::json;
using test::frameOf;
using test::objectAt;
using ::testing::HasSubstr;

std::set<std::string> idsIn(const json& list) {
  std::set<std::string> ids;
  for (const auto& one : list) ids.insert(one["id"]);
  return ids;
}

/// A path such as "/objects.objects[:].r" names a topic before the first dot.
void gatherTopics(const json& node, std::set<std::string>& topics) {
  const auto take = [&](const std::string& text) {
    const std::string name = text.substr(0, text.find_first_of(".{["));
    if (text.starts_with("/") && name != "/move_base_simple/goal" && name != "/clicked_point" &&
        name != "/initialpose") {
      topics.insert(name);
    }
  };
  if (node.is_string()) return take(node);
  if (!node.is_structured()) return;
  for (const auto& [key, value] : node.items()) {
    if (node.is_object()) take(key);
    gatherTopics(value, topics);
  }
}

TEST(FoxgloveLayout, NamesChannelsThatThereAre) {
  std::ifstream file(std::filesystem::path(std::getenv("PERDURE_SOURCE")) /
                     "tools/viewer/src/foxglove_layout.json");
  const json layout = json::parse(file);
  std::set<std::string> named, advertised;
  gatherTopics(layout, named);
  for (const ChannelInfo& channel : channelTable({"cam0"})) advertised.insert(channel.topic);
  for (const std::string& topic : named) EXPECT_TRUE(advertised.contains(topic)) << topic;
  for (const char* topic : {"/scene", "/map/scene", "/map/graph/scene", "/trajectory", "/landmarks",
                            "/camera/cam0/image", "/camera/cam0/annotations", "/log", "/health"}) {
    EXPECT_TRUE(named.contains(topic)) << topic;
  }
  const json& scene = layout["configById"]["3D!perdure"];
  EXPECT_EQ(scene["followMode"], "follow-pose");
  EXPECT_EQ(scene["followTf"], "base_link");
}

struct Parsed {
  json changes, whole;
};
Parsed updated(Scene& scene, const Objects& objects) {
  const SceneUpdate update = scene.update(objects);
  return {json::parse(update.changes), json::parse(update.whole)};
}

TEST(Scene, TellsChangesAndTheWholeForWhoMissedSome) {
  constexpr int kAll = 1;
  Scene scene;
  const Parsed first =
      updated(scene, frameOf(1, {objectAt(1, {10, 0, 0}), objectAt(2, {20, 0, 0})}));
  EXPECT_EQ(first.changes, first.whole);
  EXPECT_EQ(first.whole["deletions"][0]["type"], kAll);

  const Parsed same =
      updated(scene, frameOf(2, {objectAt(1, {10, 0, 0}), objectAt(2, {20, 0, 0})}));
  EXPECT_TRUE(same.changes["entities"].empty());
  EXPECT_TRUE(same.changes["deletions"].empty());
  EXPECT_EQ(same.whole["entities"], first.whole["entities"]);

  const Parsed moved =
      updated(scene, frameOf(3, {objectAt(1, {10, 0, 0}), objectAt(2, {20.1, 0, 0})}));
  EXPECT_EQ(idsIn(moved.changes["entities"]), std::set<std::string>{"2"});
  const Parsed gone = updated(scene, frameOf(4, {objectAt(2, {20.1, 0, 0})}));
  EXPECT_TRUE(gone.changes["entities"].empty());
  EXPECT_EQ(idsIn(gone.changes["deletions"]), std::set<std::string>{"1"});
  EXPECT_EQ(idsIn(gone.whole["entities"]), std::set<std::string>{"2"});
  const Parsed back =
      updated(scene, frameOf(5, {objectAt(1, {10, 0, 0}), objectAt(2, {20.1, 0, 0})}));
  EXPECT_EQ(idsIn(back.changes["entities"]), std::set<std::string>{"1"});
  EXPECT_TRUE(back.changes["deletions"].empty());
}

TEST(Scene, BeginsAnewInANewFrameOfReference) {
  Scene scene;
  (void)updated(scene, frameOf(1, {objectAt(1, {10, 0, 0})}));
  Objects other = frameOf(2, {objectAt(1, {10, 0, 0})});
  other.world.epoch = 2;
  const Parsed update = updated(scene, other);
  EXPECT_EQ(update.changes, update.whole);
  EXPECT_EQ(update.changes["deletions"].size(), 1u);
}

TEST(Scene, DrawsWhatIsHiddenAsStrokesWithoutABody) {
  ObjectBelief hidden = objectAt(3, {10, 0, 0});
  hidden.visibility = Visibility::kOccluded;
  hidden.blocked_by = 9;
  Scene scene;
  const json seen = updated(scene, frameOf(1, {objectAt(3, {10, 0, 0})})).whole["entities"][0];
  const json strokes = updated(scene, frameOf(2, {hidden})).changes["entities"][0];
  EXPECT_EQ(seen["cubes"].size(), 1u);
  EXPECT_TRUE(strokes["cubes"].empty());
  EXPECT_EQ(seen["lines"][0]["points"].size(), 2u * 13);
  EXPECT_GT(strokes["lines"][0]["points"].size(), 4u * 13);
  EXPECT_EQ(strokes["lines"][0]["points"].size() % 2, 0u);
  EXPECT_EQ(strokes["texts"][0]["text"], "car 3 (hidden)");
}

TEST(Scene, PutsTheCuboidAndTheEllipsoidWhereTheBeliefIs) {
  ObjectBelief object = objectAt(3, {10, -2, 1});
  object.classes[0].covariance.topLeftCorner<3, 3>() =
      Eigen::Vector3d(0.01, 0.04, 0.09).asDiagonal();
  Scene scene;
  const json entity = updated(scene, frameOf(1, {object})).whole["entities"][0];
  const json cube = entity["cubes"][0];
  EXPECT_NEAR(cube["pose"]["position"]["y"], -2, 1e-9);
  EXPECT_NEAR(cube["pose"]["orientation"]["z"], std::sin(0.25), 1e-5);
  EXPECT_NEAR(cube["size"]["x"], 4.0, 1e-3);
  std::multiset<double> diameters;
  for (const char* axis : {"x", "y", "z"})
    diameters.insert(entity["spheres"][0]["size"][axis].get<double>());
  EXPECT_THAT(std::vector<double>(diameters.begin(), diameters.end()),
              ::testing::Pointwise(::testing::DoubleNear(1e-3), {0.4, 0.8, 1.2}));
}

TEST(Beliefs, TellEverythingAboutOneObject) {
  const ObjectBelief object = objectAt(12, {1, 2, 3});
  Event returns = test::eventOf(EventKind::kPredictedReturn, 12);
  returns.returns_in_s = {2.5, 1.5, 4.0};
  const std::deque<History::Sample> history{{1.0, 0.5, 0.6, 1.0}, {2.0, 0.9, 0.7, 0.0}};
  const json full = json::parse(objectInFull(object, returns, &history));
  EXPECT_EQ(full["object"]["id"], 12);
  EXPECT_EQ(full["classes"][1]["class"], "other");
  EXPECT_EQ(full["classes"][0]["covariance"].size(), 7u);
  EXPECT_DOUBLE_EQ(full["existence"]["hit"]["nats"], 5.0);
  EXPECT_EQ(full["existence"]["hit"]["count"], 7);
  EXPECT_DOUBLE_EQ(full["ledger"]["car"]["activation"], 0.15);
  EXPECT_DOUBLE_EQ(full["returns"]["in_s"][2], 4.0);
  EXPECT_EQ(full["history"][1], (json{2.0, 0.9, 0.7, 0.0}));
}

TEST(Beliefs, AreReadableWhateverANameOnTheWireIs) {
  ObjectBelief object = objectAt(1, {0, 0, 0}, "ca\"r\\\n\xff");
  EXPECT_FALSE(
      json::parse(objectInFull(object, std::nullopt, nullptr), nullptr, false).is_discarded());
  EXPECT_FALSE(
      json::parse(objectsAtAGlance(frameOf(1, {object}), -1), nullptr, false).is_discarded());
}

TEST(Beliefs, SayEachEventInASentence) {
  for (int kind = 0; kind <= static_cast<int>(EventKind::kRestored); ++kind) {
    const Event event = test::eventOf(static_cast<EventKind>(kind), 7);
    const json said = json::parse(eventJson(event)), log = json::parse(eventLog(event));
    EXPECT_GT(said["words"].get<std::string>().size(), 8u);
    EXPECT_EQ(log["message"], said["words"]);
    EXPECT_EQ(log["name"], said["event"]);
  }
}

TEST(History, KeepsTwoSamplesASecondAndForgetsTheOldest) {
  History history;
  for (std::uint64_t i = 0; i < 8000; ++i) history.add(frameOf(i, {objectAt(1, {0, 0, 0})}));
  ASSERT_NE(history.of(1), nullptr);
  EXPECT_EQ(history.of(1)->size(), 600u);
  EXPECT_NEAR(history.of(1)->back().time_s - history.of(1)->at(598).time_s, 0.5, 1e-6);
  EXPECT_EQ(history.of(2), nullptr);
}

TEST(Annotations, AreTheProjectedCuboid) {
  const Calibration calibration = test::forwardCamera();
  const CameraModel camera(calibration.cameras[0]);
  ObjectBelief object = objectAt(4, {10, 0, 0});
  object.classes[0].mean[3] = 0;
  const json message = json::parse(imageAnnotations(frameOf(1, {object}), camera, nullptr));
  ASSERT_EQ(message["points"].size(), 1u);
  double left = 1e9, right = -1e9, top = 1e9;
  for (const auto& p : message["points"][0]["points"]) {
    left = std::min(left, p["x"].get<double>());
    right = std::max(right, p["x"].get<double>());
    top = std::min(top, p["y"].get<double>());
  }
  // The rear face is 8 m away, 1.8 m wide and 1.5 m high.
  EXPECT_NEAR(left, 320 - 400 * 0.9 / 8, 0.1);
  EXPECT_NEAR(right, 320 + 400 * 0.9 / 8, 0.1);
  EXPECT_NEAR(top, 240 - 400 * 0.75 / 8, 0.1);
  EXPECT_EQ(message["texts"][0]["text"], "car 4");
}

TEST(Annotations, LeaveOutWhatIsBehindAndDrawBoxesAsBrightAsTheyAreLikely) {
  const Calibration calibration = test::forwardCamera();
  const CameraModel camera(calibration.cameras[0]);
  ObjectBelief behind = objectAt(4, {-10, 0, 0});
  behind.visibility = Visibility::kBehind;
  Detections detections;
  detections.detections.resize(3);
  detections.detections[0] = test::detectionOf({1, 2, 3, 4}, {0.F, 2.F});
  detections.detections[1] = test::detectionOf({1, 2, 3, 4}, {0.F, -9.F});
  detections.detections[2] = test::detectionOf({1, 2, 3, 4}, {});
  const json message = json::parse(imageAnnotations(frameOf(1, {behind}), camera, &detections));
  ASSERT_EQ(message["points"].size(), 1u);
  EXPECT_NEAR(message["points"][0]["outline_color"]["a"], 1 / (1 + std::exp(-2.0)), 1e-3);
  EXPECT_TRUE(message["texts"].empty());
}

ModelInfo carsAndPersons() {
  ModelInfo model;
  model.classes = {"person", "car"};
  return model;
}

TEST(Likelihood, IsTheBrightnessOfTheRegionWhoseBoxMeetsIt) {
  const Calibration calibration = test::forwardCamera();
  const CameraModel camera(calibration.cameras[0]);
  ObjectBelief near = objectAt(4, {10, 0, 0}), far = objectAt(5, {20, 6, 0});
  near.classes[0].mean[3] = 0;
  Detections detections;
  detections.detections = {
      test::detectionOf({275, 202, 365, 278}, {0.F, 3.F, 1.F}),   // the near object's box
      test::detectionOf({300, 210, 330, 260}, {0.F, -9.F, 9.F}),  // inside, but the overlap is too
                                                                  // small
      test::detectionOf({1, 2, 3, 4}, {0.F, 9.F, 9.F})};
  const ModelInfo model = carsAndPersons();
  const json message =
      json::parse(likelihoodRegions(frameOf(1, {near, far}), camera, &detections, &model));
  ASSERT_EQ(message["points"].size(), 2u);
  // The farther object is drawn first, in black, because the network has no box for it.
  EXPECT_EQ(message["points"][0]["fill_color"]["r"], 0);
  EXPECT_EQ(message["texts"][0]["text"], "car 5 nothing said");
  EXPECT_NEAR(message["points"][1]["fill_color"]["r"], 1 / (1 + std::exp(-1.0)), 1e-3);
  EXPECT_EQ(message["texts"][1]["text"], "car 4 0.73");
  // The hull is that of the rear face, 8 m away.
  double left = 1e9, right = -1e9;
  for (const auto& p : message["points"][1]["points"]) {
    left = std::min(left, p["x"].get<double>());
    right = std::max(right, p["x"].get<double>());
  }
  EXPECT_NEAR(left, 320 - 400 * 0.9 / 8, 0.1);
  EXPECT_NEAR(right, 320 + 400 * 0.9 / 8, 0.1);
  EXPECT_LE(message["points"][1]["points"].size(), 20u);
}

TEST(Likelihood, IsTheAnswerToThePredictionWhereNoBoxMeetsIt) {
  const Calibration calibration = test::forwardCamera();
  const CameraModel camera(calibration.cameras[0]);
  Detection answer = test::detectionOf({275, 202, 365, 278}, {0.F, 0.F, -1.F});
  answer.primed = true;
  answer.primed_for = 4;
  Detections detections;
  detections.detections = {answer};
  const ModelInfo model = carsAndPersons();
  const json message = json::parse(
      likelihoodRegions(frameOf(1, {objectAt(4, {10, 0, 0}), objectAt(5, {10, 0.2, 0})}), camera,
                        &detections, &model));
  std::set<std::string> said;
  for (const auto& one : message["texts"]) said.insert(one["text"]);
  EXPECT_EQ(said, (std::set<std::string>{"car 4 0.27 top-down", "car 5 nothing said"}));
}

TEST(Likelihood, LeavesOutWhatIsHiddenAndDoesNotNeedAModel) {
  const Calibration calibration = test::forwardCamera();
  const CameraModel camera(calibration.cameras[0]);
  ObjectBelief hidden = objectAt(4, {10, 0, 0}), other = objectAt(5, {10, 0, 0}, kOtherClass);
  hidden.visibility = Visibility::kOccluded;
  Detections detections;
  detections.detections = {test::detectionOf({275, 202, 365, 278}, {0.F, 3.F, 1.F})};
  const json without =
      json::parse(likelihoodRegions(frameOf(1, {hidden, other}), camera, &detections, nullptr));
  ASSERT_EQ(without["points"].size(), 1u);
  const ModelInfo model = carsAndPersons();
  const json with =
      json::parse(likelihoodRegions(frameOf(1, {hidden, other}), camera, &detections, &model));
  EXPECT_EQ(with["texts"][0]["text"], "other 5 nothing said") << "it is no class of the network";
}

TEST(World, ThinsALongWayAndKeepsItsShape) {
  Trajectory way;
  for (int i = 0; i < 100000; ++i) {
    way.add(fromNanoseconds(i), {1, 1},
            RigidTransform(Eigen::Quaterniond::Identity(), {0.1 * i, 0, 0}));
  }
  const json poses = json::parse(way.posesInFrame())["poses"];
  EXPECT_LE(poses.size(), 4001u);
  EXPECT_GE(poses.size(), 1500u);
  EXPECT_EQ(poses.front()["position"]["x"], 0);
  EXPECT_NEAR(poses.back()["position"]["x"], 9999.9, 1e-3);
  way.add(fromNanoseconds(90000), {1, 1}, {});  // slightly late
  EXPECT_GT(json::parse(way.posesInFrame())["poses"].size(), 2u);
  way.add(fromNanoseconds(-3'000'000'000), {1, 1}, {});  // the drive starts again
  EXPECT_EQ(json::parse(way.posesInFrame())["poses"].size(), 2u);
  way.add(fromNanoseconds(1), {2, 1}, {});
  EXPECT_EQ(json::parse(way.posesInFrame())["poses"].size(), 2u);
}

TEST(World, PutsAnImageIntoCdrAsItsIdlSays) {
  const std::vector<std::uint8_t> jpeg{9, 8, 7};
  const std::string cdr = compressedImage({1, 2, fromNanoseconds(3'000'000'005), 0}, "cam0", jpeg);
  const std::string expected{0,   1, 0, 0,                    // XCDR1, little-endian
                             3,   0, 0, 0, 5,   0,   0,   0,  // time
                             13,  0, 0, 0, 'c', 'a', 'm', '0', '_', 'o', 'p', 't', 'i', 'c', 'a',
                             'l', 0, 0, 0, 0,   3,   0,   0,   0,   9,   8,   7,   0,  // data
                             5,   0, 0, 0, 'j', 'p', 'e', 'g', 0};
  EXPECT_EQ(cdr, expected);
}

TEST(VitalSigns, TellOfAServiceThatAnotherProcessStandsInFor) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  VitalSigns signs("ego");
  Health capture;
  capture.process = "capture";
  capture.state = HealthState::kOk;
  Health bridge = capture;
  bridge.process = "ros2";
  signs.onHealth(capture, kSecond);
  signs.onHealth(bridge, 10 * kSecond);
  EXPECT_TRUE(signs.hears("ros2", 10 * kSecond));
  EXPECT_FALSE(signs.hears("capture", 10 * kSecond));
  EXPECT_FALSE(signs.hears("vio", 10 * kSecond));
  EXPECT_THAT(signs.healthz(10 * kSecond), HasSubstr("\"status\":\"degraded\""));
  signs.setStandIns({{"capture", "ros2 stands in for it: it writes frame/cam0"}});
  EXPECT_THAT(signs.healthz(10 * kSecond), HasSubstr("\"status\":\"ok\""));
  EXPECT_THAT(signs.healthz(10 * kSecond), HasSubstr("\"capture\":\"stood_in_for\""));
  const json services = json::parse(signs.json(10 * kSecond, {}))["services"];
  ASSERT_EQ(services.size(), 2u);
  EXPECT_EQ(services[0]["process"], "capture");
  EXPECT_EQ(services[0]["stood_in_for"], true);
  EXPECT_THAT(services[0]["message"], HasSubstr("ros2 stands in for it"));
  EXPECT_EQ(services[1]["process"], "ros2");
}

TEST(VitalSigns, TellNoFaultOfServicesWhoseDriveHasEnded) {
  constexpr std::int64_t kNow = 1'000'000'000;
  VitalSigns signs("ego");
  Health vio;
  vio.process = "vio";
  vio.state = HealthState::kDegraded;
  vio.message = "no frames for 9.0 s; fix the camera, or start capture";
  vio.reasons["input_silent"] = 1;
  signs.onHealth(vio, kNow);
  EXPECT_EQ(json::parse(signs.healthz(kNow))["services"]["vio"], "degraded");
  Health capture;
  capture.process = "capture";
  capture.state = HealthState::kOk;
  capture.message = "end of drive";
  signs.onHealth(capture, kNow);
  EXPECT_EQ(json::parse(signs.healthz(kNow))["status"], "ok");
  EXPECT_THAT(signs.json(kNow, {}), HasSubstr("nothing more comes: end of drive"));
  EXPECT_THAT(signs.metrics(kNow, {}, {}), HasSubstr("service_state{process=\"vio\"} 1"));
  vio.reasons.clear();
  signs.onHealth(vio, kNow);
  EXPECT_EQ(json::parse(signs.healthz(kNow))["status"], "degraded") << "another fault";
}

TEST(VitalSigns, TellSilenceProcessorTimeAndReasons) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  VitalSigns signs("ego");
  Health vio;
  vio.process = "vio";
  vio.state = HealthState::kOk;
  vio.cpu_s = 1.0;
  vio.reasons = {{"imu_gap", 3}};
  EXPECT_THAT(signs.healthz(kSecond), HasSubstr("\"silent\""));
  signs.onHealth(vio, 10 * kSecond);
  vio.cpu_s = 1.25;
  signs.onHealth(vio, 11 * kSecond);
  const json health = json::parse(signs.json(11 * kSecond, {.objects_ns = 9 * kSecond}));
  EXPECT_NEAR(health["services"][0]["cpu"], 0.25, 1e-6);
  EXPECT_NEAR(health["silent_s"]["objects"], 2.0, 1e-6);
  EXPECT_LT(health["silent_s"]["odometry"], 0);
  EXPECT_THAT(signs.healthz(11 * kSecond), HasSubstr("\"status\":\"ok\""));
  EXPECT_THAT(signs.healthz(20 * kSecond), HasSubstr("\"vio\":\"silent\""));
  const std::string metrics =
      signs.metrics(11 * kSecond, {{"clients", "now", false, 2}}, {{"x", 1}});
  EXPECT_THAT(metrics, HasSubstr("perdure_service_up{process=\"vio\"} 1\n"));
  EXPECT_THAT(metrics, HasSubstr("perdure_reasons_total{process=\"vio\",reason=\"imu_gap\"} 3\n"));
  EXPECT_THAT(metrics,
              HasSubstr("# TYPE perdure_gateway_clients gauge\nperdure_gateway_clients 2\n"));
}

}  // namespace
}  // namespace perdure::gateway
