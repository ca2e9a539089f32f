#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "common/base/subprocess.h"
#include "common/bus/wait_loop.h"
#include "common/service/health.h"
#include "common/types/health.h"
#include "tests/common/bus/isolation.h"

namespace perdure::service {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class Isolation : public testing::Environment {
 public:
  void SetUp() override { tests::isolateNetwork(); }
};
const auto* const kIsolation = testing::AddGlobalTestEnvironment(new Isolation);

std::string probe() { return std::getenv("PERDURE_SERVICE_PROBE"); }

ProgramAnswer runProbe(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), probe());
  return runProgram({.command = std::move(arguments)});
}

ProgramOptions quietProbe(const std::map<std::string, std::string>& environment = {}) {
  return {.command = {probe(), "--set", "log.level=off"}, .environment = environment};
}

class Service : public testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("PERDURE_SERVICE_PROBE") == nullptr) GTEST_SKIP() << "run by ctest";
  }
};

TEST_F(Service, ChecksAConfigurationAndTellsEverythingThatIsWrongAtOnce) {
  const std::string path = testing::TempDir() + "perdure_service_test.yaml";
  std::ofstream(path) << "gian: 2\npoints: many\nlog:\n  level: loud\nbus: {domain: 999}\n";
  const ProgramAnswer outcome = runProbe({"--check-config", "--config", path, "--set", "gain=-1"});
  EXPECT_EQ(outcome.status, 78);
  EXPECT_EQ(outcome.output, path + ":1:1: gian: is not a known key; did you mean gain?\n" + path +
                                ":2:9: points: many is not a whole number\n" + path +
                                ":4:10: log.level: loud is not one of trace, debug, info, "
                                "warning, error, off\n" +
                                path + ":5:15: bus.domain: 999 is not 0 … 230\n" +
                                "--set gain=-1: gain: -1 is not > 0 m/s; use 1\n");
  std::remove(path.c_str());
}

TEST_F(Service, AcceptsASoundConfigurationAndPrintsItBack) {
  EXPECT_EQ(runProbe({"--check-config", "--set", "gain=2", "--set", "points=7"}).status, 0);
  const ProgramAnswer printed =
      runProbe({"--print-config", "--set", "gain=2", "--set", "points=7"});
  EXPECT_EQ(printed.status, 0);
  EXPECT_THAT(printed.output, StartsWith("# factor [m/s] (> 0)\ngain: 2\n# how many"));
  EXPECT_THAT(printed.output, HasSubstr("bus:\n  # network interface"));
}

TEST_F(Service, ExplainsItselfAndRefusesAWrongCommandLine) {
  EXPECT_EQ(runProbe({"--help"}).status, 0);
  EXPECT_THAT(runProbe({"--help"}).output, HasSubstr("A service for tests."));
  EXPECT_EQ(runProbe({"--version"}).status, 0);
  EXPECT_EQ(runProbe({"--no-such-option"}).status, 64);
  EXPECT_EQ(runProbe({"--config"}).status, 64);
  EXPECT_EQ(runProbe({"--config", "/nonexistent.yaml"}).status, 78);
}

TEST_F(Service, SaysWhatToFixWhereItCannotStart) {
  const ProgramAnswer outcome = runProbe({"--set", "bus.interface=nosuch0"});
  EXPECT_EQ(outcome.status, 69);
  EXPECT_THAT(outcome.output, HasSubstr("bus.interface names an interface"));
}

TEST_F(Service, NamesAWrongDomainOfTheEnvironmentAndItsRange) {
  for (const char* wrong : {"abc", "300", "-5", "7x", " 7", "1.5", "99999999999999999999"}) {
    const ProgramAnswer outcome =
        runProgram({.command = {probe()}, .environment = {{"PERDURE_DOMAIN", wrong}}},
                   std::chrono::seconds(10));
    EXPECT_EQ(outcome.status, 78) << wrong;
    EXPECT_THAT(outcome.output, HasSubstr("PERDURE_DOMAIN is `" + std::string(wrong) +
                                          "`, which is not a whole number 0 … 230"));
  }
}

TEST_F(Service, EndsInOrderWhenItsTerminalIsClosedButNotUnderNohup) {
  const auto status = [](std::vector<std::string> command) {
    const std::string log = testing::TempDir() + "perdure_service_hangup.log";
    std::remove(log.c_str());
    Subprocess running({.command = std::move(command), .log = log});
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    const auto started = [&] {
      std::ifstream in(log);
      return std::string(std::istreambuf_iterator<char>(in), {}).find("version") !=
             std::string::npos;
    };
    while (!started() && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    running.signal(SIGHUP);
    return running.wait(std::chrono::seconds(2));
  };
  EXPECT_EQ(status({probe()}), 0);
  EXPECT_FALSE(status({"nohup", probe()}));
}

TEST_F(Service, WorksTellsItsHealthAndEndsInOrderAtSigterm) {
  const bus::Domain domain{bus::Options{}};
  const bus::Participant participant(domain, "test");
  bus::WaitLoop loop(participant);
  bus::Reader<Health> health(participant, bus::kTopic<Health>);
  bus::Reader<SpeedSample> speed(participant, bus::kTopic<SpeedSample>);
  bus::Writer<ImuSample> imu(participant, bus::kTopic<ImuSample>);
  Health last;
  int samples = 0;
  loop.on(health, [&](const Health& m) { last = m; });
  loop.on(speed, [&](const SpeedSample&) { ++samples; });
  Subprocess running(quietProbe());
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while ((samples == 0 || last.reasons.count("seen") == 0) &&
         std::chrono::steady_clock::now() < deadline) {
    if (samples == 0) {
      EXPECT_TRUE(imu.write(ImuSample{}));
    }
    loop.runOnce(std::chrono::milliseconds(20));
  }
  EXPECT_GT(samples, 0);
  EXPECT_EQ(last.process, "probe");
  EXPECT_EQ(last.pid, static_cast<std::uint32_t>(running.pid()));
  EXPECT_EQ(last.state, HealthState::kOk);
  EXPECT_GT(last.frames_in, 0u);
  EXPECT_EQ(last.frames_in, last.frames_out);
  EXPECT_GT(last.rss_bytes, 1u << 20);
  running.signal(SIGTERM);
  EXPECT_EQ(running.waitForEnd(), 0);
}

TEST_F(Service, IsDegradedWhileItsInputIsSilentAndWellWhenItComesBack) {
  const bus::Domain domain{bus::Options{}};
  const bus::Participant participant(domain, "test");
  bus::WaitLoop loop(participant);
  bus::Reader<Health> health(participant, bus::kTopic<Health>);
  bus::Writer<ImuSample> imu(participant, bus::kTopic<ImuSample>);
  Health last;
  loop.on(health, [&](const Health& m) { last = m; });
  Subprocess running(quietProbe());
  ImuSample sample;
  const auto comesTo = [&](bool sends, const auto& wanted) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!wanted() && std::chrono::steady_clock::now() < deadline) {
      if (sends) {
        ++sample.sequence;
        EXPECT_TRUE(imu.write(sample));
      }
      loop.runOnce(std::chrono::milliseconds(20));
    }
    return wanted();
  };
  const auto well = [&] { return last.state == HealthState::kOk && last.message.empty(); };
  EXPECT_TRUE(comesTo(true, [&] { return well() && last.frames_in > 5; }));
  EXPECT_TRUE(comesTo(false, [&] { return last.state == HealthState::kDegraded; }));
  EXPECT_THAT(last.message, StartsWith("no samples for "));
  EXPECT_THAT(last.message, HasSubstr(" s; send some"));
  EXPECT_TRUE(last.reasons.contains(kInputSilent)) << "nothing else is wrong";
  EXPECT_TRUE(comesTo(true, well));
  EXPECT_FALSE(last.reasons.contains(kInputSilent));
  running.signal(SIGTERM);
  EXPECT_EQ(running.waitForEnd(), 0);
}

/// The socket on which systemd would listen.
class NotifySocket {
 public:
  NotifySocket() : path_(testing::TempDir() + "perdure_notify") {
    unlink(path_.c_str());
    socket_ = socket(AF_UNIX, SOCK_DGRAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof(address.sun_path) - 1);
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    setenv("NOTIFY_SOCKET", path_.c_str(), 1);
  }
  ~NotifySocket() {
    unsetenv("NOTIFY_SOCKET");
    close(socket_);
    unlink(path_.c_str());
  }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;
  std::string next(std::chrono::milliseconds longest = std::chrono::seconds(20)) const {
    const timeval patience{longest.count() / 1000, longest.count() % 1000 * 1000};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    std::array<char, 256> buffer{};
    const auto n = recv(socket_, buffer.data(), buffer.size(), 0);
    return n > 0 ? std::string(buffer.data(), static_cast<std::size_t>(n)) : "";
  }

 private:
  std::string path_;
  int socket_ = -1;
};

TEST_F(Service, TellsSystemdThatItIsReadyAliveAndStopping) {
  const NotifySocket systemd;
  Subprocess running(quietProbe({{"WATCHDOG_USEC", "2000000"}}));
  EXPECT_EQ(systemd.next(), "READY=1");
  EXPECT_EQ(systemd.next(), "WATCHDOG=1");
  EXPECT_EQ(systemd.next(), "WATCHDOG=1");
  running.signal(SIGINT);
  EXPECT_EQ(running.waitForEnd(), 0);
}

TEST_F(Service, SaysNothingToAWatchdogThatDoesNotWatch) {
  const NotifySocket systemd;
  Subprocess running(quietProbe());
  EXPECT_EQ(systemd.next(), "READY=1");
  // Health is sent in this time, but no keep-alive message
  EXPECT_EQ(systemd.next(std::chrono::milliseconds(1500)), "");
  running.signal(SIGINT);
  EXPECT_EQ(running.waitForEnd(), 0);
}

class Hangs : public Service, public testing::WithParamInterface<std::uint64_t> {};

TEST_P(Hangs, AndTheWatchdogIsNotFed) {
  const NotifySocket systemd;
  Subprocess running(quietProbe({{"WATCHDOG_USEC", "400000"}}));
  const bus::Domain domain{bus::Options{}};
  const bus::Participant participant(domain, "test");
  bus::Writer<ImuSample> imu(participant, bus::kTopic<ImuSample>);
  EXPECT_EQ(systemd.next(), "READY=1");
  EXPECT_EQ(systemd.next(), "WATCHDOG=1");
  ImuSample sample;
  sample.sequence = GetParam();
  ASSERT_TRUE(imu.write(sample));  // latched, so it arrives as soon as both are matched
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (systemd.next(std::chrono::milliseconds(1500)) == "WATCHDOG=1") {
    ASSERT_LT(std::chrono::steady_clock::now(), end) << "it is still fed";
  }
}

INSTANTIATE_TEST_SUITE_P(AHandlerOrAWorker, Hangs, testing::Values(1001, 1002));

}  // namespace
}  // namespace perdure::service
