#include "services/gateway/node.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/services/gateway/objects.h"
#include "tests/support/corrections.h"

namespace perdure::gateway {
namespace {

using nlohmann::json;
using test::frameOf;
using test::objectAt;
using ::testing::HasSubstr;
constexpr std::int64_t kSecond = 1'000'000'000;

Config configWith(const std::string& token) {
  Config config;
  config.web.token = token;
  return config;
}

class GatewayNode : public ::testing::Test {
 protected:
  explicit GatewayNode(const std::string& token = "") : config_(configWith(token)) {}

  std::vector<json> on(std::uint32_t channel) const {
    std::vector<json> found;
    for (const Encoded& one : said_) {
      if (one.channel == channel) found.push_back(json::parse(*one.payload));
    }
    return found;
  }
  Frame grey(std::uint64_t sequence) const {
    Frame frame;
    frame.stamp = {42, sequence,
                   fromNanoseconds(kSecond + 50'000'000 * static_cast<std::int64_t>(sequence)), 0};
    frame.camera = "cam0";
    frame.width = 16, frame.height = 8;
    frame.data = std::make_shared<const std::vector<std::uint8_t>>(16 * 8, std::uint8_t{90});
    return frame;
  }

  std::vector<Encoded> said_;
  std::vector<Answer> answers_;
  std::vector<MapQuery> queries_;
  std::vector<MapCorrection> corrections_;
  Config config_;
  Node node_{config_,
             "ego",
             5,
             {.message = [this](const Encoded& m) { said_.push_back(m); },
              .time = [](const TimePoint&) {},
              .answer = [this](const Answer& a) { answers_.push_back(a); },
              .query = [this](const MapQuery& q) { queries_.push_back(q); },
              .correction = [this](const MapCorrection& c) { corrections_.push_back(c); }}};
};

struct GatewayNodeWithToken : GatewayNode {
  GatewayNodeWithToken() : GatewayNode("secret") {}
};

TEST_F(GatewayNode, MakesNothingWhileNobodyLooks) {
  node_.onCalibration(test::forwardCamera());
  node_.onObjects(frameOf(1, {objectAt(1, {10, 0, 0})}), kSecond);
  node_.onFrame(0, grey(1));
  node_.onEvent(test::eventOf(EventKind::kBorn, 1));
  node_.tick(2 * kSecond);
  EXPECT_TRUE(said_.empty());
}

TEST_F(GatewayNode, TellsWhoComesWhatIsKnownAlready) {
  node_.onCalibration(test::forwardCamera());
  node_.onObjects(frameOf(1, {objectAt(1, {10, 0, 0})}), kSecond);
  node_.onEvent(test::eventOf(EventKind::kBorn, 1));
  node_.onEvent(test::eventOf(EventKind::kConfirmed, 1));
  node_.setWanted({kObjects, kScene, kEvents, kTransforms, kTrajectory, kHealth,
                   cameraChannel(0, kCalibration)});
  node_.tick(2 * kSecond);
  EXPECT_EQ(on(kObjects).at(0)["objects"][0]["id"], 1);
  EXPECT_EQ(on(kScene).at(0)["entities"].size(), 1u);
  ASSERT_EQ(on(kEvents).size(), 2u);
  EXPECT_EQ(on(kEvents)[1]["event"], "confirmed");
  EXPECT_EQ(on(kTransforms).at(0)["transforms"].size(), 3u);
  EXPECT_EQ(on(kHealth).at(0)["vehicle"], "ego");
  EXPECT_EQ(on(cameraChannel(0, kCalibration)).at(0)["K"][0], 400);
}

TEST_F(GatewayNode, TellsWhereNorthIsAfterASatellitePosition) {
  Calibration rig = test::forwardCamera();
  rig.anchor = GeoAnchor{fromNanoseconds(kSecond), 49.0, 8.4, 110.0, 0.5};
  node_.onCalibration(rig);
  node_.setWanted({kTransforms});
  Odometry odometry;
  odometry.state = OdometryState::kTracking;
  odometry.T_WB.q = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ());
  for (std::uint64_t i = 0; i < 2; ++i) {
    odometry.stamp = grey(i).stamp;
    node_.onOdometry(odometry, kSecond);
  }
  const json earth = on(kTransforms).back()["transforms"][2];
  EXPECT_EQ(earth["parent_frame_id"], "odom");
  EXPECT_EQ(earth["child_frame_id"], "enu");
  // W's x is 0.3 rad north of east.
  EXPECT_NEAR(2.0 * std::asin(earth["rotation"]["z"].get<double>()), -0.3, 1e-6);
}

TEST_F(GatewayNode, ShowsImagesAtTheRateThatIsSetAndAsJpeg) {
  node_.setWanted({cameraChannel(0, kImage)});
  for (std::uint64_t i = 0; i < 20; ++i) node_.onFrame(0, grey(i));  // sends frames at 20 Hz
  EXPECT_EQ(said_.size(), 10u);
  EXPECT_THAT(*said_[0].payload, HasSubstr("\xff\xd8\xff"));
  Frame broken = grey(40);
  broken.width = 17;
  node_.onFrame(0, broken);
  EXPECT_EQ(said_.size(), 10u);
  EXPECT_EQ(node_.reasons().of("image_image_malformed"), 1u);
}

TEST_F(GatewayNode, GoesOnWhenARecordingBeginsAgain) {
  node_.setWanted({kObjects});
  node_.onObjects(frameOf(900, {}), kSecond);
  node_.onObjects(frameOf(1, {}), kSecond);
  node_.onObjects(frameOf(2, {}), kSecond);
  EXPECT_EQ(on(kObjects).size(), 3u);
}

TEST_F(GatewayNode, DrawsTheDetectionsOfTheSameFrame) {
  node_.onCalibration(test::forwardCamera());
  node_.setWanted({cameraChannel(0, kAnnotations)});
  Detections detections;
  detections.camera = "cam0";
  detections.stamp = frameOf(1, {}).stamp;
  detections.detections = {test::detectionOf({1, 2, 3, 4}, {0.F, 3.F})};
  node_.onDetections(detections);
  node_.onObjects(frameOf(1, {}), kSecond);
  node_.onObjects(frameOf(2, {}), kSecond);
  node_.tick(kSecond);  // the detections of the second frame are missing
  const auto drawn = on(cameraChannel(0, kAnnotations));
  ASSERT_EQ(drawn.size(), 2u);
  EXPECT_EQ(drawn[0]["points"].size(), 1u);
  EXPECT_EQ(drawn[1]["points"].size(), 0u);
  // The detections arrive after the objects: each frame is drawn once, with its own detections.
  detections.stamp = frameOf(3, {}).stamp;
  node_.onObjects(frameOf(3, {}), kSecond);
  EXPECT_EQ(on(cameraChannel(0, kAnnotations)).size(), 2u);
  node_.onDetections(detections);
  node_.onObjects(frameOf(4, {}), kSecond);
  node_.onObjects(frameOf(5, {}), kSecond);
  const auto later = on(cameraChannel(0, kAnnotations));
  ASSERT_EQ(later.size(), 4u);
  EXPECT_EQ(later[2]["points"].size(), 1u);
  EXPECT_EQ(later[3]["points"].size(), 0u);
}

TEST_F(GatewayNode, AnswersAboutAnObjectOfTheWorkingSetAtOnce) {
  node_.onObjects(frameOf(1, {objectAt(12, {10, 0, 0})}), kSecond);
  Event returns = test::eventOf(EventKind::kPredictedReturn, 12);
  returns.returns_in_s = {3, 2, 5};
  node_.onEvent(returns);
  node_.onCall({7, kObjectService, 1, R"({"id":12})"}, kSecond);
  ASSERT_EQ(answers_.size(), 1u);
  EXPECT_EQ(answers_[0].client, 7u);
  EXPECT_EQ(json::parse(answers_[0].payload)["returns"]["in_s"][0], 3);
  node_.onEvent(test::eventOf(EventKind::kReappeared, 12));
  node_.onCall({7, kObjectService, 2, R"({"id":12})"}, kSecond);
  EXPECT_FALSE(json::parse(answers_[1].payload).contains("returns"));
  EXPECT_TRUE(queries_.empty());
}

TEST_F(GatewayNode, AsksTheMapForOthersAgainAndAgainAndThenGivesUp) {
  node_.onCall({7, kObjectService, 1, R"({"id":99})"}, kSecond);
  ASSERT_EQ(queries_.size(), 1u);
  EXPECT_EQ(queries_[0].object_id, 99u);
  EXPECT_EQ(queries_[0].client, 5u);
  node_.tick(kSecond + kSecond / 10);
  EXPECT_EQ(queries_.size(), 1u);
  node_.tick(kSecond + 6 * kSecond / 10);
  ASSERT_EQ(queries_.size(), 2u);
  EXPECT_EQ(queries_[1].request, queries_[0].request);
  node_.tick(5 * kSecond);
  ASSERT_EQ(answers_.size(), 1u);
  EXPECT_FALSE(answers_[0].ok);
  EXPECT_THAT(answers_[0].payload, HasSubstr("map_store does not answer"));
}

TEST_F(GatewayNode, PassesTheMapsAnswerToWhoAsked) {
  node_.onCall({7, kMapQueryService, 1, R"({"class":"car"})"}, kSecond);
  node_.onCall({8, kObjectService, 2, R"({"id":4})"}, kSecond);
  ASSERT_EQ(queries_.size(), 2u);
  EXPECT_EQ(queries_[0].kind, MapQueryKind::kByClass);
  MapReply reply;
  reply.client = 5;
  reply.request = queries_[1].request;
  reply.beliefs = {objectAt(4, {1, 2, 3})};
  node_.onMapReply(reply);
  reply.request = queries_[0].request;
  reply.objects.resize(1);
  reply.objects[0].id = 31;
  node_.onMapReply(reply);
  node_.onMapReply(reply);  // ignored, because the request was already answered
  reply.client = 6;
  node_.onMapReply(reply);  // the reply to another client
  ASSERT_EQ(answers_.size(), 2u);
  EXPECT_EQ(answers_[0].client, 8u);
  EXPECT_EQ(json::parse(answers_[0].payload)["object"]["id"], 4);
  EXPECT_EQ(json::parse(answers_[1].payload)["objects"][0]["id"], 31);
}

TEST_F(GatewayNode, RefusesQuestionsThatMakeNoSense) {
  for (const char* text :
       {"", "[]", "{\"id\":-1}", "{\"id\":\"1\"}", "{\"near\":[1,2]}", "{\"near\":[1,2,3]}",
        "{\"near\":[1,2,3],\"radius\":-1}", "{\"low\":[1,1,1],\"high\":[0,2,2]}", "{\"class\":7}",
        "{\"low\":[1,1,\"x\"],\"high\":[2,2,2]}"}) {
    node_.onCall({7, kMapQueryService, 1, text}, kSecond);
    ASSERT_FALSE(answers_.empty()) << text;
    EXPECT_FALSE(answers_.back().ok) << text;
    answers_.clear();
  }
  node_.onCall({7, kObjectService, 1, "{}"}, kSecond);
  EXPECT_FALSE(answers_.at(0).ok);
  EXPECT_TRUE(queries_.empty());
}

TEST_F(GatewayNode, TakesNoCorrectionsWithoutAToken) {
  node_.onCall({7, kCorrectService, 1, R"({"object":12,"kind":"not_there"})"}, kSecond);
  ASSERT_EQ(answers_.size(), 1u);
  EXPECT_FALSE(answers_[0].ok);
  EXPECT_THAT(answers_[0].payload, HasSubstr("set http.token"));
  EXPECT_TRUE(corrections_.empty());
}

TEST_F(GatewayNodeWithToken, SendsCorrectionsToTheMapAndPassesItsAnswer) {
  node_.onCall(
      {7, kCorrectService, 1, R"({"object":12,"kind":"same","other":15,"nats":3,"author":"Ada"})"},
      kSecond);
  node_.onCall({7, kCorrectService, 2, R"({"withdraw":4})"}, kSecond);
  ASSERT_EQ(corrections_.size(), 2u);
  Correction expected = perdure::test::ofTwo(CorrectionKind::kSame, 12, 15, 3.0);
  expected.author = "Ada";
  EXPECT_EQ(corrections_[0].correction, expected);
  EXPECT_EQ(corrections_[1].correction, perdure::test::withdrawal(4));
  node_.tick(kSecond + 6 * kSecond / 10);
  EXPECT_EQ(corrections_.size(), 4u);  // sent again, until the map answers
  MapReply reply;
  reply.client = 5;
  reply.request = corrections_[0].request;
  reply.corrections = {expected};
  node_.onMapReply(reply);
  reply.request = corrections_[1].request;
  reply.ok = false;
  reply.error = "no correction 4 stands";
  node_.onMapReply(reply);
  ASSERT_EQ(answers_.size(), 2u);
  EXPECT_EQ(json::parse(answers_[0].payload)["corrections"][0]["kind"], "same");
  EXPECT_FALSE(answers_[1].ok);
  EXPECT_EQ(answers_[1].payload, "no correction 4 stands");
}

TEST_F(GatewayNodeWithToken, NullInACorrectionIsAnAbsentField) {
  for (const char* text :
       {R"({"object":12,"kind":"not_there","nats":null,"author":null,"withdraw":null})",
        R"({"withdraw":4,"object":null,"kind":null})"}) {
    node_.onCall({7, kCorrectService, 1, text}, kSecond);
  }
  ASSERT_EQ(corrections_.size(), 2u);
  EXPECT_EQ(corrections_[0].correction, perdure::test::notThere(12));
  EXPECT_EQ(corrections_[1].correction, perdure::test::withdrawal(4));
}

TEST_F(GatewayNodeWithToken, RefusesCorrectionsThatSayNothing) {
  for (const char* text : {"", "[]", "{}", R"({"object":12})", R"({"object":12,"kind":"gone"})",
                           R"({"object":-1,"kind":"not_there"})", R"({"object":12,"kind":"class"})",
                           R"({"object":12,"kind":"same"})", R"({"withdraw":"4"})",
                           R"({"withdraw":4,"object":12})", R"({"withdraw":4,"kind":"not_there"})",
                           R"({"withdraw":null})", R"({"object":12,"kind":"same","other":null})"}) {
    node_.onCall({7, kCorrectService, 1, text}, kSecond);
    ASSERT_FALSE(answers_.empty()) << text;
    EXPECT_THAT(answers_.back().payload, HasSubstr("correct as {\"object\": 12")) << text;
    answers_.clear();
  }
  EXPECT_TRUE(corrections_.empty());
}

TEST_F(GatewayNode, LetsOnlySoManyQuestionsWait) {
  for (int i = 0; i < 70; ++i) node_.onCall({7, kMapQueryService, 1, "{}"}, kSecond);
  EXPECT_EQ(answers_.size(), 6u);
  EXPECT_EQ(node_.reasons().of("too_many_questions"), 6u);
}

MapObject onMap(ObjectId id, const WorldId& map, const Eigen::Vector3d& p_M) {
  MapObject object;
  object.id = id;
  object.world = map;
  object.class_name = "van";
  object.mean.head<3>() = p_M;
  return object;
}

/// M began as world 70. W is world 77; it is rotated by 90 degrees in M and shifted by 100 m.
MapFrame frameOfMap() {
  MapFrame frame;
  frame.stamp = frameOf(1, {}).stamp;
  frame.world = {77, 1};
  frame.map = {70, 1};
  frame.T_MW = RigidTransform(
      Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitZ())), {100, 0, 0});
  frame.sessions = 2;
  frame.loops = 3;
  frame.covariance.diagonal() << 0.04, 0.09, 0.01, 0.0001;
  return frame;
}

TEST_F(GatewayNode, ShowsTheTilesOfTheMapThatTheVehicleIsOn) {
  node_.onObjects(frameOf(1, {}), kSecond);
  node_.onMapFrame(frameOfMap());
  node_.setWanted({kMap});
  MapTile tile;
  tile.objects = {onMap(1, {70, 1}, {5, 0, 0}), onMap(2, {78, 1}, {6, 0, 0})};
  tile.objects[0].provisional = true;
  node_.onMapTile(tile);
  node_.tick(2 * kSecond);
  ASSERT_EQ(on(kMap).size(), 1u);
  const json map = on(kMap)[0];
  EXPECT_EQ(map["frame_id"], "map");
  ASSERT_EQ(map["objects"].size(), 1u);
  EXPECT_EQ(map["objects"][0]["id"], 1);
  EXPECT_EQ(map["objects"][0]["provisional"], true);
  EXPECT_EQ(map["elsewhere"], 1);
  node_.tick(4 * kSecond);
  EXPECT_EQ(on(kMap).size(), 1u);
  node_.onMapTileGone(tile);
  node_.tick(6 * kSecond);
  EXPECT_EQ(on(kMap).at(1)["all"], 0);
}

TEST_F(GatewayNode, WithoutAFrameOfTheMapTilesLieInTheOdometrysOwn) {
  node_.onObjects(frameOf(1, {}), kSecond);
  MapFrame of_before = frameOfMap();
  of_before.world = {76, 1};  // an earlier W
  node_.onMapFrame(of_before);
  node_.setWanted({kMap, kTransforms, kMapToOdom});
  MapTile tile;
  tile.objects = {onMap(1, {77, 1}, {5, 0, 0}), onMap(2, {70, 1}, {6, 0, 0})};
  node_.onMapTile(tile);
  node_.tick(2 * kSecond);
  EXPECT_EQ(on(kMap).at(0)["objects"].at(0)["id"], 1);
  EXPECT_EQ(on(kTransforms).at(0)["transforms"][0]["translation"]["x"], 0);
  EXPECT_TRUE(on(kMapToOdom).empty());
}

TEST_F(GatewayNode, TellsTheTransformFromMapToOdomAndAgainWhenItJumps) {
  node_.onObjects(frameOf(1, {}), kSecond);
  node_.setWanted({kTransforms, kMapToOdom});
  node_.onMapFrame(frameOfMap());
  const json transform = on(kTransforms).back()["transforms"][0];
  EXPECT_EQ(transform["parent_frame_id"], "map");
  EXPECT_EQ(transform["child_frame_id"], "odom");
  EXPECT_EQ(transform["translation"]["x"], 100);
  EXPECT_NEAR(transform["rotation"]["z"].get<double>(), std::sqrt(0.5), 1e-6);
  const json frame = on(kMapToOdom).at(0);
  EXPECT_EQ(frame["T_MW"][0], 100);
  EXPECT_EQ(frame["sessions"], 2);
  EXPECT_EQ(frame["loops"], 3);
  EXPECT_EQ(frame["body_sigma"], json({0.2, 0.3, 0.1, 0.01}));
  MapFrame not_known = frameOfMap();
  not_known.covariance.setZero();
  not_known.anchors = 2;
  node_.onMapFrame(not_known);
  EXPECT_EQ(on(kMapToOdom).back()["body_sigma"], json::array());
  not_known.anchors = 1;  // the map begins here
  node_.onMapFrame(not_known);
  EXPECT_EQ(on(kMapToOdom).back()["body_sigma"], json({0, 0, 0, 0}));
  MapFrame jumped = frameOfMap();
  jumped.T_MW.p.x() = 101;
  node_.onMapFrame(jumped);
  EXPECT_EQ(on(kTransforms).back()["transforms"][0]["translation"]["x"], 101);
}

TEST_F(GatewayNode, TellsOfALargeMapWhatIsNearestToTheBodyInM) {
  node_.onObjects(frameOf(1, {}), kSecond);  // the body is at the origin of W: 100 0 0 in M
  node_.onMapFrame(frameOfMap());
  node_.setWanted({kMap});
  MapTile tile;
  for (ObjectId id = 1; id <= kMostOfMap + 5; ++id) {
    tile.objects.push_back(onMap(id, {70, 1}, {static_cast<double>(id), 0, 0}));
  }
  node_.onMapTile(tile);
  node_.tick(2 * kSecond);
  const json map = on(kMap).at(0);
  EXPECT_EQ(map["all"], kMostOfMap + 5);
  ASSERT_EQ(map["objects"].size(), kMostOfMap);
  EXPECT_EQ(map["objects"][0]["id"], 100);
}

TEST_F(GatewayNode, DrawsOfTheMapWhatTheWorkingSetDoesNotHave) {
  node_.onObjects(frameOf(1, {objectAt(1, {10, 0, 0})}), kSecond);
  node_.onMapFrame(frameOfMap());
  node_.setWanted({kMapScene});
  MapTile tile;
  tile.objects = {onMap(1, {70, 1}, {5, 0, 0}), onMap(2, {70, 1}, {6, 0, 0})};
  tile.objects[1].provisional = true;
  node_.onMapTile(tile);
  node_.tick(2 * kSecond);
  const json scene = on(kMapScene).at(0);
  ASSERT_EQ(scene["entities"].size(), 1u);
  EXPECT_EQ(scene["entities"][0]["frame_id"], "map");
  EXPECT_EQ(scene["entities"][0]["cubes"][0]["pose"]["position"]["x"], 6);
  EXPECT_EQ(scene["entities"][0]["texts"][0]["text"], "van 2 (provisional)");
  constexpr int kAll = 1;
  EXPECT_EQ(scene["deletions"][0]["type"], kAll);
}

TEST_F(GatewayNode, AsksForTheGraphWhileSomebodyLooksAndNotTooOften) {
  node_.onObjects(frameOf(1, {}), kSecond);
  node_.onMapFrame(frameOfMap());
  node_.tick(kSecond);
  EXPECT_TRUE(queries_.empty()) << "nobody looks";
  node_.setWanted({kMapGraph});
  node_.tick(2 * kSecond);
  ASSERT_EQ(queries_.size(), 1u);
  EXPECT_EQ(queries_[0].kind, MapQueryKind::kGraph);
  EXPECT_EQ(queries_[0].low.x(), 100) << "around the body, in M";
  node_.onMapReply(test::graphFor(queries_[0], {70, 1}));
  ASSERT_EQ(on(kMapGraph).size(), 1u);
  node_.tick(20 * kSecond);
  EXPECT_EQ(queries_.size(), 1u) << "it has not changed";
  node_.onMapFrame(frameOfMap());
  node_.tick(21 * kSecond);
  ASSERT_EQ(queries_.size(), 2u);
  node_.onMapReply(test::graphFor(queries_[1], {70, 1}));
  node_.onEvent(test::eventOf(EventKind::kLoopClosed, 0));
  node_.tick(22 * kSecond);
  EXPECT_EQ(queries_.size(), 2u) << "a second later";
  node_.tick(24 * kSecond);
  EXPECT_EQ(queries_.size(), 3u);
  node_.onMapReply(test::graphFor(queries_[2], {70, 1}));
  node_.setWanted({});
  node_.onMapFrame(frameOfMap());
  node_.tick(60 * kSecond);
  EXPECT_EQ(queries_.size(), 3u) << "nobody looks any more";
}

TEST_F(GatewayNode, TellsWhatGroundWasSeenAndWhen) {
  node_.onCalibration(test::forwardCamera());
  node_.setWanted({kMapSeen});
  Odometry odometry;
  odometry.state = OdometryState::kTracking;
  const auto drive = [&](double x, double seconds) {
    odometry.stamp.time = fromNanoseconds(std::llround(1e9 * seconds));
    odometry.T_WB.p = {x, 0, 1.2};
    node_.onOdometry(odometry, kSecond);
  };
  drive(0, 1.0);
  drive(60, 31.0);
  const auto seen = on(kMapSeen);
  ASSERT_EQ(seen.size(), 2u);
  const auto ageAt = [&](const json& message, double x, double y) -> std::optional<double> {
    for (const auto& cell : message["cells"]) {
      const bool there = std::abs(cell[0].get<double>() - x) < 2.1;
      if (there && std::abs(cell[1].get<double>() - y) < 2.1) return cell[2].get<double>();
    }
    return std::nullopt;
  };
  EXPECT_EQ(ageAt(seen[0], 22, 2), 0.0);
  EXPECT_EQ(ageAt(seen[0], -22, 2), std::nullopt) << "behind the camera";
  EXPECT_EQ(ageAt(seen[0], 82, 2), std::nullopt) << "too far";
  EXPECT_EQ(ageAt(seen[1], 22, 2), 30.0);
  EXPECT_EQ(ageAt(seen[1], 82, 2), 0.0);

  MapReply graph;
  graph.anchors.resize(1);
  graph.anchors[0].p = {-60, 0, 1.2};
  node_.onMapGraph(graph);
  EXPECT_EQ(ageAt(on(kMapSeen).back(), -38, 2), -1.0) << "from an anchor of before";
  EXPECT_EQ(ageAt(on(kMapSeen).back(), 22, 2), 30.0);
}

TEST_F(GatewayNode, TellsTheGraphInTheFrameOfTheMapWithWhatEachPartIs) {
  node_.onObjects(frameOf(1, {}), kSecond);
  node_.onMapFrame(frameOfMap());
  node_.setWanted({kMapGraph, kMapGraphScene});
  node_.tick(2 * kSecond);
  node_.onMapReply(test::graphFor(queries_.at(0), {70, 1}));
  const json graph = on(kMapGraph).at(0);
  EXPECT_EQ(graph["frame_id"], "map");
  EXPECT_EQ(graph["why_none"], "");
  ASSERT_EQ(graph["anchors"].size(), 3u);
  EXPECT_EQ(graph["anchors"][0]["sigma"], json({0, 0, 0, 0})) << "all others are relative to it";
  EXPECT_EQ(graph["anchors"][1]["sigma"], json({0.2, 0.1, 0.05, 0.01}));
  EXPECT_EQ(graph["anchors"][2]["sigma"], json::array()) << "not known";
  EXPECT_EQ(graph["loops"][0]["sigma"].size(), 4u);
  EXPECT_EQ(graph["loops"][3]["sigma"], json::array());
  ASSERT_EQ(graph["loops"].size(), 4u);
  EXPECT_EQ(graph["loops"][2]["state"], "withdrawn");
  EXPECT_EQ(graph["loops"][3]["kind"], "tie");
  EXPECT_EQ(graph["loops"][0]["pairs"], json({{1, 1}, {2, 77}}));
  const json scene = on(kMapGraphScene).at(0);
  ASSERT_EQ(scene["entities"].size(), 1u + 3u + 4u);
  EXPECT_EQ(scene["entities"][0]["lines"][0]["points"].size(), 4u);
  EXPECT_EQ(scene["entities"][2]["spheres"][0]["pose"]["position"]["y"], 100);
  std::map<std::string, std::string> said;
  for (const json& pair : scene["entities"][4]["metadata"]) said[pair["key"]] = pair["value"];
  EXPECT_EQ(scene["entities"][4]["id"], "loop 1");
  EXPECT_EQ(said["anchors"], "1 and 3");
  EXPECT_EQ(said["sigma x y z, yaw"], "0.100 0.100 0.050 m, 0.23 deg");
  EXPECT_EQ(said["by objects"], "1, 2 (seen as 77)");
  EXPECT_EQ(scene["entities"][3]["metadata"][2]["value"], "not known");
  EXPECT_NE(scene["entities"][3]["spheres"][0]["color"],
            scene["entities"][2]["spheres"][0]["color"]);
  std::set<std::string> colours;
  for (std::size_t i = 4; i < 8; ++i) {
    colours.insert(scene["entities"][i]["lines"][0]["color"].dump());
    EXPECT_EQ(scene["entities"][i]["frame_id"], "map");
  }
  EXPECT_EQ(colours.size(), 4u) << "each state looks different";
}

TEST_F(GatewayNode, SaysWhyThereIsNoGraph) {
  node_.onObjects(frameOf(1, {}), kSecond);
  node_.onMapFrame(frameOfMap());
  node_.setWanted({kMapGraph});
  node_.tick(2 * kSecond);
  MapReply refusal;
  refusal.client = 5;
  refusal.request = queries_.at(0).request;
  refusal.ok = false;
  refusal.error = "the map has no graph";
  node_.onMapReply(refusal);
  EXPECT_EQ(on(kMapGraph).at(0)["why_none"], "the map has no graph");
  EXPECT_TRUE(answers_.empty()) << "no client has asked";
  node_.tick(4 * kSecond);
  EXPECT_EQ(queries_.size(), 1u);
  node_.tick(8 * kSecond);
  ASSERT_EQ(queries_.size(), 2u) << "it may have one later";
  node_.onMapReply(test::graphFor(queries_[1], {60, 1}));
  EXPECT_TRUE(on(kMapGraph).at(1)["anchors"].empty()) << "its place in this map is not known";
  EXPECT_THAT(on(kMapGraph)[1]["why_none"].get<std::string>(), HasSubstr("not found yet"));
  node_.onMapFrame(frameOfMap());
  node_.tick(20 * kSecond);
  for (int i = 0; i < 40; ++i) node_.tick(20 * kSecond + i * kSecond / 10);
  EXPECT_EQ(on(kMapGraph).size(), 2u) << "map_store is silent: what was told stays";
  EXPECT_TRUE(answers_.empty());
}

TEST_F(GatewayNode, WhoAsksLaterIsToldWhereAnEventBeforeTheFirstPoseWas) {
  Objects frame = frameOf(1, {});
  frame.T_WB.p.x() = 3;
  Event loop = test::eventOf(EventKind::kLoopClosed, 0);
  loop.world = frame.world;
  node_.onEvent(loop);
  node_.onObjects(frame, kSecond);
  node_.setWanted({kEvents});
  const auto told = on(kEvents);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0]["at"], json({3, 0, 0}));
}

TEST_F(GatewayNode, TellsWhereAnEventWas) {
  Objects frame = frameOf(1, {objectAt(12, {10, -2, 0})});
  frame.T_WB.p.x() = 3;
  node_.onObjects(frame, kSecond);
  node_.setWanted({kEvents, kLog});
  Event loop = test::eventOf(EventKind::kLoopWithdrawn, 0);
  loop.detail = "loop 4";
  Event seen = test::eventOf(EventKind::kReappeared, 12),
        absent = test::eventOf(EventKind::kGone, 9);
  for (Event* event : {&loop, &seen, &absent}) event->world = frame.world;
  Event other = loop;
  other.world.epoch = 2;
  for (const Event& event : {loop, seen, absent, other}) node_.onEvent(event);
  const auto told = on(kEvents);
  ASSERT_EQ(told.size(), 4u);
  EXPECT_EQ(told[0]["at"], json({3, 0, 0}));
  EXPECT_EQ(told[0]["words"], "the map took a loop back");
  EXPECT_EQ(told[1]["at"], json({10, -2, 0}));
  EXPECT_FALSE(told[2].contains("at"));
  EXPECT_FALSE(told[3].contains("at"));
  constexpr int kWarning = 3;
  EXPECT_EQ(on(kLog).at(0)["level"], kWarning);
  EXPECT_EQ(on(kLog)[0]["message"], "the map took a loop back: loop 4");
}

/// Without subscribers, the node receives only events and latched topics.
TEST_F(GatewayNode, BeginsTheWayAnewAfterAWhileInWhichNobodyLooked) {
  Objects frame = frameOf(1, {objectAt(12, {10, -2, 0})});
  node_.setWanted({kTrajectory});
  node_.onObjects(frame, kSecond);
  node_.setWanted({});
  Event loop = test::eventOf(EventKind::kLoopClosed, 0);
  loop.world = frame.world;
  loop.stamp = frameOf(100, {}).stamp;
  node_.onEvent(loop);
  Objects much_later = frameOf(200, {objectAt(12, {10, -2, 0})});
  much_later.T_WB.p.x() = 80;
  node_.onObjects(much_later, 20 * kSecond);
  node_.setWanted({kTrajectory, kEvents});
  for (const json& pose : on(kTrajectory).back()["poses"]) EXPECT_EQ(pose["position"]["x"], 80);
  ASSERT_EQ(on(kEvents).size(), 1u);
  EXPECT_FALSE(on(kEvents)[0].contains("at")) << "where the vehicle was then nobody heard";
}

TEST_F(GatewayNode, GoesOnWithTheWayWhereSomebodyLooksAgainAtOnce) {
  node_.setWanted({kTrajectory});
  node_.onObjects(frameOf(1, {}), kSecond);
  node_.setWanted({});
  Objects next = frameOf(2, {});
  next.T_WB.p.x() = 1;
  node_.onObjects(next, kSecond);
  node_.setWanted({kTrajectory});
  EXPECT_EQ(on(kTrajectory).back()["poses"][0]["position"]["x"], 0);
}

TEST_F(GatewayNode, WhatIsOfBeforeDoesNotReplaceWhatIsNewer) {
  node_.setWanted({kObjects, cameraChannel(0, kImage)});
  node_.onObjects(frameOf(5, {}), kSecond);
  node_.onFrame(0, grey(5));
  said_.clear();
  node_.onObjectsOfBefore(frameOf(4, {}));
  node_.onFrameOfBefore(0, grey(4));
  EXPECT_TRUE(said_.empty());
  node_.onObjectsOfBefore(frameOf(6, {}));
  EXPECT_EQ(on(kObjects).at(0)["latency_ms"], -1);
}

TEST_F(GatewayNode, ObjectsHaveTheStandardDeviationOfTheBodyIfItsOdometryIsReceived) {
  node_.setWanted({kObjects});
  node_.onObjects(frameOf(5, {}), kSecond);
  EXPECT_EQ(on(kObjects).back()["body_sigma"], -1);
  Odometry odometry;
  odometry.stamp = frameOf(6, {}).stamp;
  odometry.world = frameOf(6, {}).world;
  odometry.state = OdometryState::kTracking;
  odometry.covariance.diagonal().segment<3>(3) << 0.04, 0.04, 0.01;
  node_.onOdometry(odometry, kSecond);
  node_.onObjects(frameOf(6, {}), kSecond);
  EXPECT_DOUBLE_EQ(on(kObjects).back()["body_sigma"], 0.3);
}

TEST_F(GatewayNode, AnswersSayWhatLiesOnAnotherMap) {
  node_.onObjects(frameOf(1, {}), kSecond);
  node_.onMapFrame(frameOfMap());
  node_.onCall({7, kMapQueryService, 1, "{}"}, kSecond);
  MapReply reply;
  reply.client = 5;
  reply.request = queries_.at(0).request;
  reply.objects = {onMap(1, {70, 1}, {0, 0, 0}), onMap(2, {60, 1}, {0, 0, 0})};
  node_.onMapReply(reply);
  const json objects = json::parse(answers_.at(0).payload)["objects"];
  EXPECT_EQ(objects[0]["elsewhere"], false);
  EXPECT_EQ(objects[1]["elsewhere"], true);
}

TEST(GatewayConfig, RefusesAnOpenPortWithoutAToken) {
  Config config;
  verify(config);
  config.web.address = "0.0.0.0";
  EXPECT_ANY_THROW(verify(config));
  config.web.token = "s3cret";
  verify(config);
}

}  // namespace
}  // namespace perdure::gateway
