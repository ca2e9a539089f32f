#include "common/replay/files/counters.h"

#include <fmt/format.h>

#include <array>

namespace perdure::replay {
namespace {

using std::chrono::hours, std::chrono::seconds;

/// The length of a counter of 2^bits / hz seconds; 2^bits · 10⁹ may exceed 64 bits.
Duration lengthOf(int bits, std::int64_t hz) {
  const std::int64_t ticks = std::int64_t{1} << bits, rest = ticks % hz;
  return seconds(ticks / hz) + Duration(rest * 1'000'000'000 / hz);
}

void addTicks(std::vector<Counter>& all) {
  struct Tick {
    std::int64_t ns;
    const char* name;
  };
  constexpr std::array kTicks{Tick{1, "ns"},           Tick{100, "100 ns"},
                              Tick{1000, "µs"},        Tick{10'000, "10 µs"},
                              Tick{100'000, "100 µs"}, Tick{1'000'000, "ms"}};
  for (const int bits : {16, 20, 24, 30, 31, 32}) {
    for (const Tick& tick : kTicks) {
      all.push_back({Duration((std::int64_t{1} << bits) * tick.ns),
                     fmt::format("{} bits of {}", bits, tick.name)});
    }
  }
}

/// Cycle counters of 32 bits of the usual microcontrollers and processors.
void addCycles(std::vector<Counter>& all) {
  for (const std::int64_t mhz :
       {16,  48,  64,  72,  80,  84,  96,  100, 120, 125, 133, 150, 160, 168, 170,
        180, 200, 216, 240, 250, 280, 300, 400, 480, 500, 528, 550, 600, 800, 1000}) {
    all.push_back(
        {lengthOf(32, mhz * 1'000'000), fmt::format("32 bits of cycles at {} MHz", mhz), true});
  }
}

std::vector<Counter> allCounters() {
  std::vector<Counter> all;
  addTicks(all);
  all.insert(all.end(), {{lengthOf(32, 90'000), "32 bits of 1/90 ms (RTP)"},
                         {lengthOf(33, 90'000), "33 bits of 1/90 ms (MPEG)"},
                         {lengthOf(24, 32'768), "24 bits of 1/32768 s"},
                         {lengthOf(32, 32'768), "32 bits of 1/32768 s"},
                         {lengthOf(24, 25'600), "24 bits of 39.0625 µs (a sensor's time)"},
                         {lengthOf(32, 40'000), "32 bits of 25 µs (a sensor's time)"},
                         {Duration(std::int64_t{1} << 48), "48 bits of ns"},
                         {std::chrono::minutes(1), "a minute"},
                         {hours(1), "an hour"},
                         {hours(24), "a day"},
                         {hours(7 * 24), "a week"}});
  addCycles(all);
  return all;
}

}  // namespace

const std::vector<Counter>& knownCounters() {
  static const std::vector<Counter> kAll = allCounters();
  return kAll;
}

}  // namespace perdure::replay
