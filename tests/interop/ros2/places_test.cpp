// Tests the domain of ROS: a domain of its own beside a closed bus, and settings that are rejected
// at the start.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/interop/ros2/bridge_rig.h"
#include "tests/services/run_until.h"

namespace perdure::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

/// Returns a domain for ROS beside that of the bus.
std::string besideDomain(const bus::Domain& domain) {
  return std::to_string((bus::withEnvironment(domain.options()).domain + 101) % 230);
}

std::string refusal(const Settings& settings, int status) {
  Folder folder;
  std::vector<std::string> command{(programs() / "perdure-ros2").string()};
  for (const std::string& setting : settings) command.insert(command.end(), {"--set", setting});
  Child bridge(command, folder.file("log"));
  EXPECT_EQ(bridge.wait(20s), status) << bridge.log();
  return bridge.log();
}

TEST(Ros2Places, RosHasADomainOfItsOwnBesideAClosedBus) {
  BridgeRig rig;
  const std::string security = rig.folder.file("security");
  Child init({(programs() / "perdure").string(), "security", "init", "--dir", security},
             rig.folder.file("init"));
  ASSERT_EQ(init.wait(60s), 0) << init.log();
  EXPECT_THAT(refusal({"bus.security=" + security}, 78),
              HasSubstr("ROS without SROS2 cannot join it: set ros.domain"));
  Child add({(programs() / "perdure").string(), "security", "add", "ros2_driver", "camera_of_ros",
             "--topics", "frame/cam0", "calibration", "--dir", security},
            rig.folder.file("add"));
  ASSERT_EQ(add.wait(60s), 0) << add.log();

  const std::string beside = besideDomain(rig.domain);
  const std::vector<std::string> bridge{(programs() / "perdure-ros2").string(), "--set",
                                        "bus.security=" + security, "--set",
                                        "ros.domain=" + beside};
  const Child reading(bridge, rig.folder.file("reading"));
  rig.listen({"/perdure/diagnostics"}, beside);
  EXPECT_TRUE(eventually(40s, [&] { return !rig.heard().empty(); })) << reading.log() << rig.log();

  auto writing = bridge;
  writing.insert(writing.end(), {"--set", "in.cam0.image=/camera/image_raw"});
  Child refused(writing, rig.folder.file("refused"));
  EXPECT_EQ(refused.wait(20s), 78) << refused.log();
  EXPECT_THAT(refused.log(), HasSubstr("the identity of this process may not make"));
  writing.insert(writing.end(), {"--set", "bus.identity=camera_of_ros"});
  Child allowed(writing, rig.folder.file("allowed"));
  EXPECT_EQ(allowed.wait(2s), -1) << "it runs; " << allowed.log();
}

bool run(const Folder& folder, const std::string& script) {
  Child shell({"/bin/sh", "-ec", script}, folder.file("shell"));
  return shell.wait(10s) == 0;
}

/// Returns whether a node that starts now receives a message of the bridge within five seconds.
bool meets(const Folder& folder, std::vector<std::string> command) {
  command.insert(command.end(), {std::getenv("PERDURE_ROS_LISTENER"), "0", "/perdure/diagnostics"});
  const Child node(command, folder.file("node"));
  return eventually(5s, [&] { return !node.log().empty(); });
}

TEST(Ros2Places, DefaultNodesMeetTheBridgeOnAHostWithTwoCardsAndOnAnother) {
  BridgeRig rig;
  const Child other({"unshare", "--net", "sleep", "100"}, rig.folder.file("other"));
  const std::string pid = std::to_string(other.pid());
  const std::string there = "nsenter --net=/proc/" + pid + "/ns/net ip ";
  if (rig.domain.options().domain != 0 ||
      !run(rig.folder, "sleep .3; ip link add card0 type veth peer name eth0 netns " + pid +
                           "; ip addr add 10.9.0.1/24 dev card0; ip link set card0 up; " + there +
                           "addr add 10.9.0.2/24 dev eth0; " + there + "link set lo up; " + there +
                           "link set eth0 up; "
                           "ip link add card1 type veth peer name peer1; ip link set peer1 up; "
                           "ip addr add 10.8.0.1/24 dev card1; ip link set card1 up")) {
    GTEST_SKIP() << "skipped: needs network namespaces and iproute2";
  }
  rig.startBridge({});
  EXPECT_TRUE(meets(rig.folder, {})) << rig.log();
  EXPECT_TRUE(meets(rig.folder, {"nsenter", "--net=/proc/" + pid + "/ns/net"})) << rig.log();
  EXPECT_THAT(rig.log(), HasSubstr("on lo,card0,card1 (ros.interface), found by multicast"));

  ASSERT_TRUE(run(rig.folder, "ip link del card0; ip link del card1"));
  EXPECT_TRUE(runUntil(rig.loop, [&] {
    return rig.sentence().find("are lo: restart perdure-ros2") != std::string::npos;
  })) << rig.sentence();
}

TEST(Ros2Places, WhatCannotBeIsRefusedWithTheFix) {
  EXPECT_THAT(refusal({"in.imu.topic=/imu"}, 78), HasSubstr("camera and IMU come from one source"));
  EXPECT_THAT(refusal({"in.cam0.image=camera/image"}, 78), HasSubstr("is no topic of ROS"));
  EXPECT_THAT(refusal({"in.detections.topic=/boxes"}, 78),
              HasSubstr("list the detector's classes, as [car, person]"));
  EXPECT_THAT(refusal({"out.enabled=false"}, 78),
              HasSubstr("nothing goes out and nothing comes in"));
  EXPECT_THAT(refusal({"ros.interface=absent7"}, 69), HasSubstr("ros.interface names interfaces"));
  EXPECT_THAT(refusal({"ros.peers=[a b]"}, 78), HasSubstr("ros.peers: \"a b\" is no address"));
}

}  // namespace
}  // namespace perdure::test
