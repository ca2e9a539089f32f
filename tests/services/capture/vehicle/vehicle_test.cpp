// Tests speed and position of the vehicle from sockets. A pair of sockets replaces a CAN bus, which
// few kernels of test machines have.
#include "services/capture/vehicle/vehicle.h"

#include <gmock/gmock.h>
#include <linux/can.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <vector>

#include "common/base/errors.h"
#include "services/capture/live/clocks.h"

namespace perdure::capture {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

struct Wire {
  explicit Wire(int type) { (void)::socketpair(AF_UNIX, type, 0, ends); }
  ~Wire() { ::close(ends[1]); }
  OpenSocket open() const {
    return [end = ends[0]]() -> Result<int> { return ::dup(end); };
  }
  void send(const void* data, std::size_t size) const { (void)!::write(ends[1], data, size); }
  void send(const std::string& text) const { send(text.data(), text.size()); }
  void can(std::uint32_t id, std::vector<std::uint8_t> data) const {
    can_frame frame{};
    frame.can_id = id;
    frame.can_dlc = static_cast<std::uint8_t>(data.size());
    std::copy(data.begin(), data.end(), frame.data);
    send(&frame, sizeof frame);
  }
  int ends[2];
};

struct Heard {
  Vehicle::Outputs outputs() {
    return {[this](const SpeedReading& reading) {
              const std::lock_guard lock(mutex);
              speeds.push_back(reading);
            },
            [this](const EarthPlace& place) {
              const std::lock_guard lock(mutex);
              places.push_back(place);
            }};
  }
  bool wait(const std::function<bool(const Heard&)>& done) {
    for (int i = 0; i < 1000; ++i, std::this_thread::sleep_for(5ms)) {
      const std::lock_guard lock(mutex);
      if (done(*this)) return true;
    }
    return false;
  }
  std::mutex mutex;
  std::vector<SpeedReading> speeds;
  std::vector<EarthPlace> places;
};

SpeedConfig canSpeed() {
  SpeedConfig config;
  config.source = "can";
  config.can_signals = {R"(0x1a0 0|16@1+ (0.01,0) [0|300] "km/h")"};
  config.latency_s = 0.02;
  return config;
}

TEST(Vehicle, HearsItsSpeedOnACanBus) {
  const Wire bus(SOCK_SEQPACKET);
  Heard heard;
  Vehicle vehicle(canSpeed(), {}, heard.outputs(), bus.open(), {});
  bus.can(0x1a0, {0x10, 0x0e});
  ASSERT_TRUE(heard.wait([](const Heard& h) { return h.speeds.size() == 1; }));
  EXPECT_NEAR(heard.speeds[0].speed, 10.0, 1e-12);
  EXPECT_LT(heard.speeds[0].time_ns, HostClock::nowNs() - 19'000'000) << "it was old";
  EXPECT_EQ(vehicle.problem(), "");
  EXPECT_EQ(vehicle.name(), "speed of can0");
  bus.can(0x1a0, {0xff, 0xff});
  bus.send("no frame");
  ASSERT_TRUE(heard.wait([&](const Heard&) {
    ReasonCounts counts;
    vehicle.report(counts);
    return counts.of("speed_can_invalid") == 1 && counts.of("speed_malformed") == 1;
  }));
  EXPECT_THAT(vehicle.problem(), HasSubstr("0x1a0"));
}

TEST(Vehicle, HearsItsSpeedInLines) {
  const Wire lines(SOCK_DGRAM);
  Heard heard;
  SpeedConfig speed;
  speed.source = "udp";
  speed.sigma = 0.1;
  Vehicle vehicle(speed, {}, heard.outputs(), lines.open(), {});
  lines.send("2.5");
  lines.send("-1.5, 0.3\n");
  lines.send("7\n8\n0.5\r\n");  // all at one time: the last one counts
  lines.send("fast");
  ASSERT_TRUE(heard.wait([](const Heard& h) { return h.speeds.size() == 3; }));
  EXPECT_DOUBLE_EQ(heard.speeds[0].speed, 2.5);
  EXPECT_DOUBLE_EQ(heard.speeds[0].sigma, 0.1);
  EXPECT_DOUBLE_EQ(heard.speeds[1].speed, -1.5);
  EXPECT_DOUBLE_EQ(heard.speeds[1].sigma, 0.3);
  EXPECT_DOUBLE_EQ(heard.speeds[2].speed, 0.5);
  ASSERT_TRUE(heard.wait([&](const Heard&) { return !vehicle.problem().empty(); }));
  EXPECT_THAT(vehicle.problem(), HasSubstr("SPEED SIGMA"));
}

TEST(Vehicle, LinesOfSpeedAreReadToTheirEnd) {
  for (const char* line : {"", " ", "1.5 x", "1.5x", "1.5 0", "1.5 -1", "nan", "1.5 0.1 3", "inf",
                           "5,2", "100000", "-300 1"}) {
    EXPECT_FALSE(readSpeedLine(line, 0.1, 0)) << line;
  }
  for (const char* line : {"1.5", " 1.5 ", "1.5,0.2", "5, 2", "1.5\t0.2", "1.5 , 0.2 "}) {
    EXPECT_TRUE(readSpeedLine(line, 0.1, 0)) << line;
  }
}

TEST(Vehicle, SaysThatAFixIsTooUncertainForTheMap) {
  const Wire gpsd(SOCK_STREAM);
  Heard heard;
  GnssConfig gnss;
  gnss.source = "gpsd";
  Vehicle vehicle({}, gnss, heard.outputs(), {}, gpsd.open());
  gpsd.send(R"({"class":"TPV","mode":3,"lat":49.0,"lon":8.4,"altHAE":110,"speed":5,"track":90})"
            "\n");
  ASSERT_TRUE(heard.wait([&](const Heard&) {
    return vehicle.problem().find("gnss.most_sigma") != std::string::npos;
  })) << vehicle.problem();
  ReasonCounts counts;
  vehicle.report(counts);
  EXPECT_EQ(counts.of("gnss_uncertain"), 1U) << "an error that is not stated is not small";
}

TEST(Vehicle, RefusesAddressesThatAreNone) {
  const auto refuses = [](const std::string& address) {
    SpeedConfig speed;
    speed.source = "udp";
    speed.address = address;
    try {
      checkVehicle(speed, {});
    } catch (const StartupError& error) {
      return std::string(error.what()).find("HOST:PORT") != std::string::npos;
    }
    return false;
  };
  for (const char* wrong : {"foo", "", ":5600", "host:", "host:x", "host:0", "host:70000"}) {
    EXPECT_TRUE(refuses(wrong)) << wrong;
  }
  EXPECT_FALSE(refuses("127.0.0.1:5600"));
  EXPECT_FALSE(refuses("[::1]:5600"));
}

TEST(Vehicle, KnowsItsPlaceAndSpeedByGpsd) {
  const Wire gpsd(SOCK_STREAM);
  Heard heard;
  SpeedConfig speed;
  speed.source = "gnss";
  GnssConfig gnss;
  gnss.source = "gpsd";
  Vehicle vehicle(speed, gnss, heard.outputs(), {}, gpsd.open());
  gpsd.send("{\"class\":\"TPV\",\"mode\":1}\n");
  ASSERT_TRUE(heard.wait([&](const Heard&) {
    return vehicle.problem().find("no fix") != std::string::npos;
  })) << vehicle.problem();
  for (int i = 0; i < 12; ++i) {  // their times are the times of arrival
    gpsd.send(R"({"class":"TPV","mode":3,"lat":49.0,"lon":8.4,"altHAE":110,"eph":4,"speed":5,)"
              "\"track\":90}\n");
    std::this_thread::sleep_for(220ms);
  }
  ASSERT_TRUE(heard.wait([](const Heard& h) { return h.places.size() == 1; }));
  EXPECT_NEAR(heard.places[0].latitude_deg, 49.0, 1e-12);
  EXPECT_NEAR(heard.places[0].yaw, 0.0, 1e-12);
  EXPECT_EQ(heard.speeds.size(), 12U);
  EXPECT_EQ(vehicle.problem(), "");
}

}  // namespace
}  // namespace perdure::capture
