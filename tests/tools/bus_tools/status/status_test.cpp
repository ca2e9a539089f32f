#include "tools/bus_tools/status/status.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace perdure::tools {
namespace {

using testing::HasSubstr;
using testing::Not;

/// A vehicle at 20 Hz without any fault.
StatusSeen sound() {
  StatusSeen seen;
  seen.vehicle = "ego";
  for (const char* name : {"capture", "vio", "inference", "semantic_filter", "map_store"}) {
    ServiceSeen service;
    service.health.process = name;
    service.health.state = HealthState::kOk;
    service.health.pid = 7;
    service.age_s = 0.4;
    service.frames_hz = 20.0;
    seen.services[name] = service;
  }
  Calibration calibration;
  calibration.cameras.resize(1);
  calibration.cameras[0].name = "cam0";
  calibration.cameras[0].rate_hz = 20.0;
  calibration.imu.emplace().rate_hz = 200.0;
  seen.calibration = calibration;
  for (const char* name : {"odometry", "landmarks", "detections", "objects", "predictions"}) {
    seen.topics[name] = {1, 1, 40, 19.9, 0.03, 12.0};
  }
  seen.topics["imu"] = {1, 1, 400, 200.1, 0.004, {}};
  seen.topics["frame/cam0"] = {1, 2, 0, 0.0, {}, {}};
  seen.topics["events"] = {1, 1, 0, 0.0, {}, {}};
  seen.host.disks = {{"/var/lib/perdure", 50ULL << 30, 100ULL << 30}};
  seen.host.clock_synchronised = true;
  return seen;
}

const StatusNode& find(const StatusNode& node, const std::string& name) {
  static const StatusNode kNone{"none"};
  for (const StatusNode& child : node.children) {
    if (child.name == name) return child;
    const StatusNode& below = find(child, name);
    if (below.name == name) return below;
  }
  return kNone;
}

/// Returns the level of `name`; checks that it is also the root's level.
Level dominating(const StatusSeen& seen, const std::string& name) {
  const StatusNode root = judge(seen);
  EXPECT_EQ(root.level, find(root, name).level) << toText(root, false);
  return find(root, name).level;
}

TEST(Status, IsOkWhereEverythingIs) {
  const StatusNode root = judge(sound());
  EXPECT_EQ(root.level, Level::kOk) << toText(root, false);
  EXPECT_THAT(find(root, "odometry").text, HasSubstr("19.9 of 20 Hz"));
  EXPECT_THAT(find(root, "odometry").text, HasSubstr("12 ms from capture"));
  EXPECT_THAT(find(root, "imu").text, HasSubstr("200.1 of 200 Hz"));
  EXPECT_THAT(find(root, "frame/cam0").text, HasSubstr("20.0 of 20 Hz"));
}

TEST(Status, FailsWhereNobodyIsThere) {
  StatusSeen seen;
  seen.vehicle = "ego";
  const StatusNode root = judge(seen);
  EXPECT_EQ(root.level, Level::kFailed);
  EXPECT_EQ(root.text, "no service is heard");
}

TEST(Status, AServiceThatIsMissingOrSilentHasFailed) {
  StatusSeen seen = sound();
  seen.services.erase("vio");
  EXPECT_EQ(dominating(seen, "vio"), Level::kFailed);
  seen = sound();
  seen.services["map_store"].age_s = 1.6;
  EXPECT_EQ(dominating(seen, "map_store"), Level::kFailed);
  EXPECT_THAT(find(judge(seen), "map_store").text, HasSubstr("says nothing for 1.6 s"));
}

/// The bridge to ROS 2 receives a camera, an IMU and a foreign odometry.
StatusSeen bridged() {
  StatusSeen seen = sound();
  seen.services["ros2"] = seen.services.at("capture");
  seen.services["ros2"].health.process = "ros2";
  seen.services.erase("capture");
  seen.services.erase("vio");
  for (const char* name : {"frame/cam0", "imu", "calibration", "odometry", "health"})
    seen.topics[name].written_by = {"ros2"};
  seen.topics["landmarks"] = {0, 2, 0, 0.0, {}, {}};
  return seen;
}

TEST(Status, IsOkWhereTheBridgeStandsInForCaptureAndVio) {
  const StatusNode root = judge(bridged());
  EXPECT_EQ(root.level, Level::kOk) << toText(root, false);
  EXPECT_EQ(find(root, "capture").text, "ros2 stands in for it: it writes frame/cam0");
  EXPECT_EQ(find(root, "vio").text, "ros2 stands in for it: it writes odometry");
  EXPECT_EQ(toJson(find(root, "vio"))["stand_in"], "ros2");
  EXPECT_THAT(find(root, "frame/cam0").text, HasSubstr("20.0 of 20 Hz"));
  EXPECT_THAT(find(root, "landmarks").text, HasSubstr("the odometry of ros2 has none"));
}

TEST(Status, AStandInWhoseDataDoNotComeHasFailed) {
  StatusSeen seen = bridged();
  seen.topics["odometry"].age_s = 2.0;
  EXPECT_EQ(dominating(seen, "odometry"), Level::kFailed);
  seen = bridged();
  seen.services["ros2"].frames_hz = 0.0;
  EXPECT_EQ(dominating(seen, "frame/cam0"), Level::kFailed);
  seen = bridged();
  seen.services["ros2"].age_s = 3.0;
  EXPECT_EQ(dominating(seen, "ros2"), Level::kFailed);
  seen = bridged();
  seen.calibration.reset();
  EXPECT_EQ(dominating(seen, "sensors"), Level::kDegraded);
  EXPECT_THAT(find(judge(seen), "sensors").text, HasSubstr("ros2 gives it"));
}

TEST(Status, WhatWritesOtherTopicsStandsInForNobody) {
  StatusSeen seen = bridged();
  seen.topics["odometry"].written_by = {};
  EXPECT_EQ(dominating(seen, "vio"), Level::kFailed);
  EXPECT_THAT(find(judge(seen), "vio").text, HasSubstr("is not heard"));
  seen = sound();
  seen.services.erase("semantic_filter");
  seen.topics["objects"].written_by = {"ros2"};
  EXPECT_EQ(dominating(seen, "semantic_filter"), Level::kFailed);
}

TEST(Status, AServiceThatIsHeardIsJudgedItself) {
  StatusSeen seen = bridged();
  seen.services["vio"] = sound().services.at("vio");
  seen.services["vio"].health.state = HealthState::kFailed;
  EXPECT_EQ(dominating(seen, "vio"), Level::kFailed);
  seen.services["vio"].age_s = 60.0;  // vio was stopped, and the bridge has replaced it
  EXPECT_EQ(judge(seen).level, Level::kOk);
}

TEST(Status, AStandInWithoutHealthDoesNotTellItsRateOfFrames) {
  StatusSeen seen = bridged();
  seen.services.erase("ros2");
  for (auto& [name, topic] : seen.topics) {
    if (topic.written_by.contains("ros2")) topic.written_by = {"my driver"};
  }
  EXPECT_EQ(judge(seen).level, Level::kOk) << toText(judge(seen), false);
}

TEST(Status, AServiceThatWasStartedJustNowIsWorthTelling) {
  StatusSeen seen = sound();
  seen.services["vio"].up_s = 4.0;
  EXPECT_EQ(dominating(seen, "vio"), Level::kDegraded);
  EXPECT_THAT(find(judge(seen), "vio").text, HasSubstr("started 4.0 s ago"));
  seen.services["vio"].up_s = 6.0;
  EXPECT_EQ(judge(seen).level, Level::kOk);
}

TEST(Status, TellsHowLongAServiceIsUpAndHowOftenItWasStartedMeanwhile) {
  StatusSeen seen = sound();
  seen.services["vio"].up_s = 90.0;
  seen.services["capture"].up_s = 7 * 3600.0;
  seen.services["capture"].restarts = 2;
  const StatusNode root = judge(seen);
  EXPECT_THAT(find(root, "vio").text, HasSubstr("up 90 s"));
  EXPECT_THAT(find(root, "vio").text, Not(HasSubstr("anew")));
  EXPECT_THAT(find(root, "capture").text, HasSubstr("up 7 h"));
  EXPECT_THAT(find(root, "capture").text, HasSubstr("was started anew 2 times"));
  EXPECT_EQ(toJson(find(root, "capture"))["restarts"], 2);
}

TEST(Status, TellsWhatIsOnTheMapAndOfItsGraph) {
  StatusSeen seen = sound();
  EXPECT_THAT(find(judge(seen), "graph").text, HasSubstr("graph.enabled"));
  seen.map_header.emplace();
  seen.map_header->objects = 412;
  seen.map_header->tiles = 1;
  MapFrame& frame = seen.map_frame.emplace();
  frame.anchors = 57;
  frame.loops = 3;
  frame.sessions = 1;
  EXPECT_THAT(find(judge(seen), "graph").text, HasSubstr("cannot be told"));
  EXPECT_FALSE(toJson(find(judge(seen), "graph")).contains("body_sigma"));
  frame.covariance.diagonal() << 0.04, 0.09, 0.01, 0.0001;
  const StatusNode root = judge(seen);
  EXPECT_EQ(root.level, Level::kOk);
  EXPECT_EQ(find(find(root, "map"), "objects").text, "412 in 1 tile");
  EXPECT_EQ(find(root, "graph").text,
            "57 anchors, 3 loops, 1 session; the body is known to 0.30 m, 0.6° (σ)");
  seen.services.erase("map_store");
  EXPECT_EQ(find(judge(seen), "map").name, "none");
}

TEST(Status, ACameraThatNobodyHasIsNotMissed) {
  StatusSeen seen = sound();
  seen.topics["frame/cam1"] = {0, 1, 0, 0.0, {}, {}};
  EXPECT_EQ(find(judge(seen), "frame/cam1").name, "none");
}

TEST(Status, TellsWhatAServiceSaysOfItself) {
  StatusSeen seen = sound();
  seen.services["map_store"].health.state = HealthState::kDegraded;
  seen.services["map_store"].health.message = "the disk is full";
  EXPECT_EQ(dominating(seen, "map_store"), Level::kDegraded);
  EXPECT_THAT(find(judge(seen), "map_store").text, HasSubstr("the disk is full"));
  seen.services["map_store"].health.state = HealthState::kFailed;
  EXPECT_EQ(dominating(seen, "map_store"), Level::kFailed);
}

TEST(Status, ATopicBelowItsRateIsDegradedASilentOneHasFailed) {
  StatusSeen seen = sound();
  seen.topics["detections"].rate_hz = 15.9;
  EXPECT_EQ(dominating(seen, "detections"), Level::kDegraded);
  seen.topics["detections"].rate_hz = 16.1;
  EXPECT_EQ(judge(seen).level, Level::kOk);
  seen.topics["detections"].age_s = 0.6;
  EXPECT_EQ(dominating(seen, "detections"), Level::kFailed);
  seen.topics["detections"].age_s.reset();
  EXPECT_EQ(dominating(seen, "detections"), Level::kFailed);
  seen = sound();
  seen.topics["objects"].writers = 0;
  EXPECT_EQ(dominating(seen, "objects"), Level::kFailed);
  EXPECT_THAT(find(judge(seen), "objects").text, HasSubstr("nobody writes it"));
}

TEST(Status, LateResultsAreDegraded) {
  StatusSeen seen = sound();
  seen.topics["objects"].latency_ms = 250.0;
  EXPECT_EQ(dominating(seen, "objects"), Level::kDegraded);
}

TEST(Status, ACameraOrAnImuThatIsGoneHasFailed) {
  StatusSeen seen = sound();
  seen.services["capture"].frames_hz = 0.0;
  EXPECT_EQ(dominating(seen, "frame/cam0"), Level::kFailed);
  seen = sound();
  seen.topics["imu"].age_s = 0.7;
  EXPECT_EQ(dominating(seen, "imu"), Level::kFailed);
}

TEST(Status, SpeedCountsWhereTheVehicleTellsIt) {
  StatusSeen seen = sound();
  seen.topics["speed"] = {1, 1, 0, 0.0, {}, {}};
  EXPECT_EQ(judge(seen).level, Level::kOk);
  seen.calibration->has_speed = true;
  EXPECT_EQ(dominating(seen, "speed"), Level::kFailed);
  seen.topics["speed"] = {1, 1, 100, 50.0, 0.02, {}};
  EXPECT_EQ(judge(seen).level, Level::kOk);
}

TEST(Status, ExpectsNothingBeforeTheDriveAndAfterIt) {
  StatusSeen seen = sound();
  for (auto& [name, topic] : seen.topics) topic.age_s = 60.0;
  seen.services["capture"].frames_hz = 0.0;
  seen.services["capture"].health.message = "end of drive";
  EXPECT_EQ(judge(seen).level, Level::kOk);
  seen.services["capture"].health.message = "waits for readers: vio";
  seen.services["capture"].health.state = HealthState::kStarting;
  EXPECT_EQ(dominating(seen, "capture"), Level::kDegraded);
}

TEST(Status, ADriveThatHasEndedIsNoFaultOfTheServicesThatWaitForMore) {
  StatusSeen seen = sound();
  for (auto& [name, topic] : seen.topics) topic.age_s = 60.0;
  const auto silence = [&](const char* name) {
    auto& service = seen.services[name];
    service.frames_hz = 0.0;
    service.health.state = HealthState::kDegraded;
    service.health.message = "no frames for 60.0 s; fix the camera, or start capture";
    service.health.reasons["input_silent"] = 1;
  };
  for (const char* name : {"vio", "inference", "semantic_filter"}) silence(name);
  seen.services["capture"].frames_hz = 0.0;
  EXPECT_EQ(judge(seen).level, Level::kFailed) << "a camera that died";
  EXPECT_EQ(find(judge(seen), "vio").level, Level::kDegraded);
  seen.services["capture"].health.message = "end of drive";
  EXPECT_EQ(judge(seen).level, Level::kOk) << toText(judge(seen), false);
  EXPECT_THAT(find(judge(seen), "vio").text, HasSubstr("nothing more comes: end of drive"));
  EXPECT_THAT(find(judge(seen), "vio").text, Not(HasSubstr("fix the camera")));
  EXPECT_EQ(toJson(find(judge(seen), "vio"))["ended"], true);
  seen.services["vio"].health.reasons.clear();
  EXPECT_EQ(dominating(seen, "vio"), Level::kDegraded) << "something else is wrong with it";
  silence("vio");
  seen.services["capture"].age_s = 2.0;
  EXPECT_EQ(find(judge(seen), "vio").level, Level::kDegraded) << "capture is gone";
}

TEST(Status, WithoutCalibrationTheSensorsAreDegraded) {
  StatusSeen seen = sound();
  seen.calibration.reset();
  EXPECT_EQ(dominating(seen, "sensors"), Level::kDegraded);
}

TEST(Status, SeesAFullDiskAHotProcessorAndAClockThatWasSet) {
  StatusSeen seen = sound();
  seen.host.disks[0].free_bytes = 900ULL << 20;
  EXPECT_EQ(dominating(seen, "disk /var/lib/perdure"), Level::kDegraded);
  seen.host.disks[0].free_bytes = 50ULL << 20;
  EXPECT_EQ(dominating(seen, "disk /var/lib/perdure"), Level::kFailed);
  seen = sound();
  seen.host.temperatures = {{"cpu", 96.0, 105.0}};
  EXPECT_EQ(dominating(seen, "temperature cpu"), Level::kDegraded);
  seen = sound();
  seen.services["vio"].health.reasons["wall_clock_stepped"] = 1;
  EXPECT_EQ(judge(seen).level, Level::kOk);
  seen.services["vio"].health.reasons["wall_clock_stepped_just_now"] = 1;
  EXPECT_EQ(dominating(seen, "clock"), Level::kDegraded);
}

TEST(Status, AnUnsynchronisedClockMattersAcrossHosts) {
  StatusSeen seen = sound();
  seen.host.clock_synchronised = false;
  EXPECT_EQ(judge(seen).level, Level::kOk);
  seen.host.several_hosts = true;
  EXPECT_EQ(dominating(seen, "clock"), Level::kDegraded);
}

TEST(Status, IsATreeForPeopleAndForPrograms) {
  const StatusNode root = judge(sound());
  const std::string text = toText(root, false);
  EXPECT_THAT(text, HasSubstr("perdure ego                   ok\n├ services"));
  EXPECT_THAT(text, HasSubstr("│ └ map_store"));
  EXPECT_THAT(text, HasSubstr("└ host"));
  EXPECT_THAT(text, Not(HasSubstr("\033")));
  EXPECT_THAT(toText(root, true), HasSubstr("\033[32mok\033[0m"));
  const auto json = toJson(root);
  EXPECT_EQ(json["level"], "ok");
  EXPECT_EQ(json["children"][0]["name"], "services");
  EXPECT_EQ(json["children"][0]["children"][0]["pid"], 7);
  EXPECT_EQ(json["children"][1]["children"][0]["name"], "frame/cam0");
  EXPECT_EQ(json["children"][1]["children"][0]["expected_hz"], 20.0);
}

TEST(Status, SurvivesAMessageThatIsNoText) {
  StatusSeen seen = sound();
  seen.services["vio"].health.message = "broken \xff\xfe bytes";
  EXPECT_THAT(dumped(toJson(judge(seen))), HasSubstr("broken"));
}

TEST(Status, TellsOfTheIdentityThatEndsFirstAndOfOneThatIsNotFit) {
  using namespace std::chrono_literals;
  const auto now = std::chrono::system_clock::now();
  StatusSeen seen = sound();
  EXPECT_EQ(find(judge(seen), "security").name, "none") << "an open bus has none";
  seen.host.closed = true;
  seen.host.identities = {{"capture", now + 24h * 100 + 1h, {}}, {"vio", now + 24h * 90 + 1h, {}}};
  seen.services["vio"].health.reasons["security_refused_no_certificate"] = 3;
  seen.services["vio"].health.reasons["security_refused_expired"] = 4;
  EXPECT_EQ(dominating(seen, "security"), Level::kOk);
  EXPECT_THAT(find(judge(seen), "security").text, HasSubstr("vio ends in 90 days"));
  EXPECT_THAT(find(judge(seen), "security").text, HasSubstr("refused 7 times"));
  seen.host.identities[0].until = now + 72h + 1h;
  EXPECT_EQ(dominating(seen, "security"), Level::kDegraded);
  EXPECT_THAT(find(judge(seen), "security").text, HasSubstr("capture ends in 3 days"));
  seen.host.identities[1] = {"vio", {}, "the identity vio was revoked"};
  EXPECT_EQ(dominating(seen, "security"), Level::kFailed);
  EXPECT_THAT(find(judge(seen), "security").text, HasSubstr("was revoked"));
}

}  // namespace
}  // namespace perdure::tools
