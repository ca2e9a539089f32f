#include "common/bus/topics.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <set>

#include "common/bus/domain.h"
#include "common/bus/once.h"

namespace perdure::bus {
namespace {

TEST(TopicTable, KnowsEveryNameThatHasAType) {
  for (const TopicInfo& info : topicTable()) {
    const std::string name = info.name == "frame/" ? "frame/cam0" : std::string(info.name);
    std::string type;
    EXPECT_TRUE(withTopic(name, [&]<class T>(const Topic<T>&) {
      type = wire::Type<T>::descriptor().m_typename;
    })) << name;
    EXPECT_EQ(type, info.typeName()) << name;
    EXPECT_EQ(findTopic(name), &info);
  }
  EXPECT_EQ(findTopic("nothing"), nullptr);
  EXPECT_EQ(findTopic("frame/"), nullptr);
  EXPECT_FALSE(withTopic("frame/", [](const auto&) {}));
}

TEST(TopicTable, NamesEachTopicOnce) {
  std::set<std::string_view> names;
  for (const TopicInfo& info : topicTable()) EXPECT_TRUE(names.insert(info.name).second);
}

TEST(TopicTable, GivesDetectionsALeaseThatDoesNotFlap) {
  EXPECT_GE(findTopic("detections")->qos.lease_s, 0.3);
  EXPECT_DOUBLE_EQ(leaseFor(10), 0.3);
  EXPECT_DOUBLE_EQ(leaseFor(60), 0.1);
}

TEST(TopicTable, KeepsEnoughInertialSamplesForARestartedReader) {
  EXPECT_TRUE(findTopic("imu")->qos.latched);
  EXPECT_EQ(findTopic("imu")->qos.late, 512);
}

TEST(Once, PassesEachIdentityOnceAndCountsTheRest) {
  Once once(2);
  EXPECT_TRUE(once.first(1, 1));
  EXPECT_TRUE(once.first(2, 1));
  EXPECT_FALSE(once.first(1, 1));
  EXPECT_EQ(once.repeated(), 1u);
  EXPECT_TRUE(once.first(1, 2));
  EXPECT_TRUE(once.first(1, 1)) << "it remembers only the newest two";
}

TEST(Gaps, CountsNumbersThatASourceLeftOut) {
  Gaps gaps;
  EXPECT_EQ(gaps.before(1, 40), 0u) << "who comes late has missed nothing";
  EXPECT_EQ(gaps.before(1, 41), 0u);
  EXPECT_EQ(gaps.before(1, 44), 2u);
  EXPECT_EQ(gaps.before(1, 44), 0u) << "twice";
  EXPECT_EQ(gaps.before(1, 43), 0u) << "late: it was counted, and DDS does not reorder one writer";
  EXPECT_EQ(gaps.before(1, 45), 0u);
  EXPECT_EQ(gaps.before(2, 7), 0u) << "another run of capture";
  EXPECT_EQ(gaps.before(2, 9), 1u);
}

TEST(Configuration, OfLoopbackIsUnicastAndOfANetworkLeavesFragmentsAlone) {
  const std::string lo = configurationXml({});
  EXPECT_NE(lo.find("<Peer Address=\"127.0.0.1\"/>"), std::string::npos);
  EXPECT_NE(lo.find("<ParticipantIndex>auto"), std::string::npos);
  EXPECT_NE(lo.find("<FragmentSize>65000B"), std::string::npos);
  EXPECT_EQ(lo.find("<NackDelay>"), std::string::npos);
  const std::string eth = configurationXml({.interface = "eth0"});
  EXPECT_NE(eth.find("<AllowMulticast>true"), std::string::npos);
  EXPECT_NE(eth.find("<NackDelay>5ms"), std::string::npos);
  const std::string far = configurationXml({.interface = "lo0", .peers = {"10.0.0.2", "vehicle"}});
  EXPECT_NE(far.find("<AllowMulticast>false"), std::string::npos);
  EXPECT_NE(far.find("<Peer Address=\"10.0.0.2\"/><Peer Address=\"vehicle\"/>"), std::string::npos);
  EXPECT_NE(eth.find("name=\"eth0\""), std::string::npos);
  EXPECT_EQ(eth.find("FragmentSize"), std::string::npos);
}

}  // namespace
}  // namespace perdure::bus
