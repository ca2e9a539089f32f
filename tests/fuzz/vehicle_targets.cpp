// Targets: inputs of a vehicle's speed and place. They are lines of a DBC file and CAN frames,
// lines over UDP, and reports of gpsd.
#include <cmath>
#include <numbers>

#include "services/capture/vehicle/earth_anchor.h"
#include "services/capture/vehicle/gpsd.h"
#include "services/capture/vehicle/socket_stream.h"
#include "services/capture/vehicle/vehicle.h"
#include "services/capture/vehicle/wheel_speed.h"
#include "tests/fuzz/target.h"

namespace perdure::fuzz {
namespace {

using namespace capture;  // NOLINT

constexpr std::int64_t kTenth_ns = 100'000'000;

void requireSound(const SpeedReading& reading) {
  require(std::isfinite(reading.speed), "a speed is finite");
  require(std::isfinite(reading.sigma) && reading.sigma > 0.0, "its deviation is known");
}

void requireSound(const GnssFix& fix) {
  constexpr double kHighest_m = 1e5;  // the limit of store.earth_anchor
  require(std::abs(fix.latitude_deg) <= 90.0 && std::abs(fix.longitude_deg) <= 180.0 &&
              std::abs(fix.height_m) <= kHighest_m,
          "a place is on Earth");
  require(fix.sigma_m > 0.0, "its deviation is known");
  require(!fix.speed || std::isfinite(*fix.speed), "a speed is finite");
  require(!fix.course || std::abs(*fix.course) <= std::numbers::pi, "a course is a direction");
}

/// Estimates a place from fixes and checks it.
class Places {
 public:
  void offer(const GnssFix& fix) {
    requireSound(fix);
    const auto place = anchor_.offer(fix, false);
    if (!place) return;
    require(std::abs(place->latitude_deg) <= 90.0 && std::isfinite(place->longitude_deg) &&
                std::isfinite(place->height_m) && std::isfinite(place->yaw),
            "a place of the body is finite");
  }

 private:
  EarthAnchor anchor_{{5.0, {1.0, 0.2, 1.5}}};
};

/// Splits the bytes into lines, as a connection delivers them in pieces.
void forLines(View bytes, const std::function<void(std::string_view, std::int64_t)>& take) {
  constexpr std::size_t kPiece = 37;
  Lines lines;
  std::int64_t now_ns = 0;
  const auto later = [&](std::string_view line, std::int64_t) { take(line, now_ns += kTenth_ns); };
  for (; !bytes.empty(); bytes = bytes.subspan(std::min(bytes.size(), kPiece))) {
    lines.add({bytes.first(std::min(bytes.size(), kPiece)), now_ns}, later);
  }
  lines.end(now_ns, later);
}

/// The first line is the wheel signal, the second the reverse signal or empty. The rest are frames:
/// one byte selects the id, one gives the length, then the data follow.
bool takeCan(View bytes) {
  const std::string text = textOf(bytes);
  const std::size_t first = std::min(text.find('\n'), text.size());
  const std::size_t second = std::min(text.find('\n', first + 1), text.size());
  WheelSettings settings;
  if (!unlessRefused([&] {
        const std::string reverse =
            first < second ? text.substr(first + 1, second - first - 1) : "";
        settings = wheelSettings({text.substr(0, first), text.substr(0, first)}, reverse, 0.05);
      })) {
    return false;
  }
  WheelSpeed wheels(settings);
  View rest = bytes.subspan(std::min(second + 1, bytes.size()));
  for (std::int64_t now_ns = kTenth_ns; rest.size() > 1; now_ns += kTenth_ns) {
    const bool reverse = rest[0] % 3 == 2 && settings.reverse;
    const CanSignal& signal = reverse ? *settings.reverse : settings.wheels.front();
    const std::size_t length = std::min<std::size_t>({rest[1], 64, rest.size() - 2});
    const auto reading = wheels.frame(signal.id, signal.extended, rest.subspan(2, length), now_ns);
    if (reading) requireSound(*reading);
    rest = rest.subspan(2 + length);
  }
  return true;
}

std::vector<Bytes> canSeeds() {
  std::vector<Bytes> seeds;
  for (const std::string lines :
       {"0x1a0 7|16@0+ (0.01,0) [0|655.35] \"km/h\"\n0x1b0 3|1@1+ (1,0) == 1\n",
        "416 SG_ WheelSpeed_RL : 23|16@0+ (0.0625,-3.5) [0|400] \"km/h\" ABS,\"Gateway\"\n\n",
        "2566831870 0|64@1- (1e-3,0) \"m/s\"\n0x98febf0b 8|8@1- (0.5,-10) [-100|100] == -2.5\n"}) {
    Bytes seed = bytesOf(lines);
    for (const Bytes& frame : {Bytes{0, 8, 1, 2, 3, 4, 5, 6, 7, 8}, Bytes{2, 2, 9, 9},
                               Bytes{1, 8, 8, 7, 6, 5, 4, 3, 2, 1}, Bytes{0, 1, 5}}) {
      seed.insert(seed.end(), frame.begin(), frame.end());
    }
    seeds.push_back(seed);
  }
  return seeds;
}

bool takeSpeedLines(View bytes) {
  bool all = true;
  forLines(bytes, [&](std::string_view line, std::int64_t now_ns) {
    const auto reading = readSpeedLine(line, 0.1, now_ns);
    all &= reading.has_value();
    if (reading) requireSound(*reading);
  });
  return all;
}

bool takeGpsd(View bytes) {
  Places places;
  bool fixed = false;
  forLines(bytes, [&](std::string_view line, std::int64_t now_ns) {
    const auto fix = readGpsd(line, now_ns);
    if (!fix) return require(!fix.error().code.empty(), "a refusal has a reason");
    if (*fix) places.offer(**fix);
    fixed |= fix->has_value();
  });
  return fixed;
}

std::vector<Bytes> gpsdSeeds() {
  std::string drive = "{\"class\":\"VERSION\",\"release\":\"3.22\",\"proto_major\":3}\n";
  for (int i = 0; i < 30; ++i) {
    drive +=
        "{\"class\":\"TPV\",\"mode\":3,\"lat\":47.28,\"lon\":8.56,\"altHAE\":547.6,"
        "\"eph\":1.2,\"speed\":9.5,\"track\":77.5}\n";
  }
  return {bytesOf(drive),
          bytesOf("{\"class\":\"TPV\",\"mode\":3,\"lat\":-1,\"lon\":-180,\"alt\":5e1}\n"
                  "{\"class\":\"SKY\",\"satellites\":[]}\n")};
}

}  // namespace

std::vector<Target> vehicleTargets() {
  const auto speeds = [] {
    return std::vector<Bytes>{bytesOf("12.5\n-3 0.2\n1e1,\t0.05 \n"), bytesOf("0.25, 0.5")};
  };
  return {{"can_speed", 9000, canSeeds, takeCan},
          {"speed_lines", 9000, speeds, takeSpeedLines},
          {"gpsd", 4200, gpsdSeeds, takeGpsd}};
}

}  // namespace perdure::fuzz
