// Runs the commands like a user, on topics that this test publishes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/base/subprocess.h"
#include "common/bus/wait_loop.h"
#include "tests/common/bus/isolation.h"
#include "tools/bus_tools/doctor/doctor.h"

namespace perdure::tools {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class Isolation : public testing::Environment {
 public:
  void SetUp() override { tests::isolateNetwork(); }
};
const auto* const kIsolation = testing::AddGlobalTestEnvironment(new Isolation);

ProgramAnswer run(const std::vector<std::string>& command) {
  return runProgram({.command = command});
}

class BusTools : public testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("PERDURE_TOOL") == nullptr) GTEST_SKIP() << "run by ctest";
    perdure = std::getenv("PERDURE_TOOL");
  }

  /// Runs a command while objects and odometry are published at 50 Hz.
  ProgramAnswer runWhilePublishing(const std::vector<std::string>& command) {
    std::atomic<bool> done = false;
    std::thread publisher([&] {
      const bus::Domain domain{bus::Options{}};
      const bus::Participant participant(domain, "semantic_filter");
      bus::Writer<Objects> objects(participant, bus::kTopic<Objects>);
      bus::Writer<Odometry> odometry(participant, bus::kTopic<Odometry>);
      bus::WaitLoop loop(participant);
      loop.every(std::chrono::milliseconds(20), [&] {
        (void)objects.write(oneCar());
        (void)odometry.write(Odometry{});
        if (done) loop.stop();
      });
      loop.run();
    });
    const ProgramAnswer outcome = run(command);
    done = true;
    publisher.join();
    return outcome;
  }

  static Objects oneCar() {
    Objects message;
    message.stamp.sequence = 9;
    ObjectBelief car;
    car.id = 5;
    car.existence = 1.0;
    car.classes.push_back({"car", 1.0, Vector7d::Ones(), Matrix7d::Identity()});
    message.objects = {car};
    return message;
  }

  std::string perdure;
};

TEST_F(BusTools, EchoPrintsJsonLinesAndEndsAfterItsCount) {
  const ProgramAnswer outcome =
      runWhilePublishing({perdure, "echo", "objects", "--count", "2", "--seconds", "20"});
  EXPECT_EQ(outcome.status, 0);
  std::istringstream lines(outcome.output);
  std::string line;
  int count = 0;
  while (std::getline(lines, line)) {
    const auto json = nlohmann::json::parse(line);
    EXPECT_EQ(json["objects"][0]["classes"][0]["name"], "car");
    EXPECT_EQ(json["objects"][0]["visibility"], "visible");
    ++count;
  }
  EXPECT_EQ(count, 2);
}

TEST_F(BusTools, HzTellsTheRate) {
  const ProgramAnswer outcome = runWhilePublishing({perdure, "hz", "odometry", "--seconds", "2.5"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_THAT(outcome.output, HasSubstr("odometry: "));
  EXPECT_THAT(outcome.output, HasSubstr(" Hz, interval "));
}

TEST_F(BusTools, HzDoesNotCountMessagesFromBeforeItsStart) {
  const bus::Domain domain{bus::Options{}};
  const bus::Participant participant(domain, "capture");
  bus::Writer<ImuSample> imu(participant, bus::kTopic<ImuSample>);
  for (int i = 0; i < 400; ++i) EXPECT_TRUE(imu.write(ImuSample{}));
  EXPECT_THAT(run({perdure, "hz", "imu", "--seconds", "1.5"}).output,
              HasSubstr("imu: 0 messages, 1 writers"));
}

TEST_F(BusTools, TopicsListsTheTableAndWhoIsThere) {
  const ProgramAnswer outcome = runWhilePublishing({perdure, "topics"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_THAT(outcome.output,
              testing::ContainsRegex("objects +perdure::msg::Objects +reliable 8, the "
                                     "newest kept +10 Hz +1 \\(semantic_filter\\) +0"));
  EXPECT_THAT(outcome.output, testing::ContainsRegex("map/header +perdure::msg::MapHeader"));
}

TEST_F(BusTools, AnUnknownTopicIsRefusedWithTheKnownOnes) {
  const ProgramAnswer outcome = run({perdure, "echo", "objcts"});
  EXPECT_EQ(outcome.status, 64);
  EXPECT_THAT(outcome.output, HasSubstr("there is no topic objcts; the topics are frame/<camera>"));
}

TEST_F(BusTools, TheEnvironmentLetsAProgramOfSomebodyElseFindTheTopics) {
  const std::string example = std::getenv("PERDURE_EXAMPLE");
  const ProgramAnswer outcome = runWhilePublishing(
      {"sh", "-c", "eval \"$(\"$0\" env)\"; timeout 3 \"$1\" | head -n 1", perdure, example});
  EXPECT_EQ(outcome.output, "frame 9: object 5 is a car (100 %) at 1.0 1.0 1.0 m\n");
}

TEST_F(BusTools, TheEnvironmentSuitsOurOwnProgramsToo) {
  const ProgramAnswer outcome = runWhilePublishing(
      {"sh", "-c", "eval \"$(\"$0\" env)\"; \"$0\" echo odometry --count 1 --seconds 20", perdure});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_THAT(outcome.output, StartsWith("{\"stamp\":"));
}

TEST_F(BusTools, DoctorNamesWhoIsThereAndWhoIsNot) {
  const ProgramAnswer outcome =
      runWhilePublishing({perdure, "doctor", "--data-dir", "/nonexistent"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.output, HasSubstr("OK   semantic_filter is on the bus"));
  EXPECT_THAT(outcome.output, HasSubstr("WARN vio is not on the bus"));
  EXPECT_THAT(outcome.output, HasSubstr("FAIL /nonexistent is not a folder: `mkdir -p"));
  EXPECT_THAT(outcome.output, HasSubstr("OK   65500-byte datagrams pass over loopback"));
}

TEST_F(BusTools, DoctorLooksAtNoPosesBesideAFixAndSaysSo) {
  const ProgramAnswer outcome = runWhilePublishing(
      {perdure, "doctor", "--data", "DRIVE", "--fix", "COPY", "--poses", "poses.tum"});
  EXPECT_EQ(outcome.status, 64);
  EXPECT_THAT(outcome.output, HasSubstr("a second call, with --data COPY"));
}

TEST_F(BusTools, StatusNamesWhatIsNotThereAndEndsWithTheWorst) {
  const ProgramAnswer outcome = runWhilePublishing({perdure, "status"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.output, testing::ContainsRegex("vio +failed +is not heard"));
  EXPECT_THAT(outcome.output, testing::ContainsRegex("objects +ok "));
}

TEST_F(BusTools, StatusWatchesAndSpeaksJson) {
  const ProgramAnswer outcome =
      runWhilePublishing({"timeout", "-s", "INT", "5", perdure, "status", "--watch", "--json"});
  std::istringstream lines(outcome.output);
  std::string line;
  int count = 0;
  for (; std::getline(lines, line); ++count) {
    const auto json = nlohmann::json::parse(line);
    EXPECT_EQ(json["level"], "failed");
    EXPECT_EQ(json["children"][0]["name"], "services");
  }
  EXPECT_GE(count, 2);
}

TEST_F(BusTools, DoctorPacksAReportWithoutImages) {
  const std::string folder = testing::TempDir() + "perdure_report_test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  const ProgramAnswer outcome =
      runWhilePublishing({perdure, "doctor", "--seconds", "1", "--report", folder + "/r.tar.gz"});
  EXPECT_THAT(outcome.output, HasSubstr("report: "));
  const ProgramAnswer list = run({"tar", "-tzf", folder + "/r.tar.gz"});
  for (const char* file : {"versions.txt", "host.txt", "doctor.txt", "status.json", "status.txt",
                           "health.jsonl", "journal.txt", "configuration/capture.yaml"}) {
    EXPECT_THAT(list.output, HasSubstr(std::string("perdure-report/") + file));
  }
  EXPECT_THAT(list.output, Not(testing::ContainsRegex("p[gp]m")));
  const ProgramAnswer status =
      run({"tar", "-xzOf", folder + "/r.tar.gz", "perdure-report/status.json"});
  EXPECT_EQ(nlohmann::json::parse(status.output)["level"], "failed");
  std::filesystem::remove_all(folder);
}

TEST_F(BusTools, DoctorMissesRouDiWhereTheConfigurationWantsSharedMemory) {
  const std::string folder = testing::TempDir() + "perdure_doctor_test";
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/capture.yaml") << "bus:\n  shared_memory_mb: 8\n";
  std::ofstream(folder + "/vio.yaml") << "bus: {shared_memory_mb: 2}\n";
  EXPECT_EQ(configuredSharedMemory(folder), 8);
  std::ofstream(folder + "/roudi.toml") << "[[segment.mempool]]\nsize = 2097152\ncount = 4\n";
  const Findings findings = checkSharedMemory({.shared_memory_mb = 8}, folder + "/roudi.toml");
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings.back().verdict, Verdict::kFail);
  EXPECT_THAT(findings.back().text, HasSubstr("largest chunk"));
  EXPECT_TRUE(checkSharedMemory({.shared_memory_mb = 0}, "").empty());
  std::filesystem::remove_all(folder);
}

TEST_F(BusTools, DoctorFindsAnInterfaceThatIsNotThere) {
  const Findings findings = checkHost({.interface = "nosuch0"});
  EXPECT_EQ(findings[1].verdict, Verdict::kFail);
  EXPECT_THAT(findings[1].text, HasSubstr("there is no interface nosuch0"));
}

TEST_F(BusTools, DoctorAcceptsAFolderThatCanBeWritten) {
  EXPECT_NE(checkWritable(testing::TempDir()).verdict, Verdict::kFail);
}

}  // namespace
}  // namespace perdure::tools
