// Measures the cost of the bus between two processes: age on arrival and CPU time, for inertial
// samples and VGA images. The file that PERDURE_BUS names holds the settings.
// usage: perdure_bus_probe send|receive SECONDS
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <iostream>
#include <random>

#include "common/base/errors.h"
#include "common/bus/wait_loop.h"

namespace perdure::bus {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::uint32_t kWidth = 640, kHeight = 480;
constexpr std::chrono::microseconds kImuPeriod{5000}, kFramePeriod{33333};

std::int64_t nowNs() { return Clock::now().time_since_epoch().count(); }

double processorSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

Options settings() {
  std::vector<config::Problem> problems;
  const Options options = commonOptions("", problems);
  config::refuse(problems);
  return options;
}

Frame noise() {
  std::mt19937 dice(1);
  std::vector<std::uint8_t> pixels(std::size_t{kWidth} * kHeight);
  for (auto& pixel : pixels) pixel = static_cast<std::uint8_t>(dice());
  Frame frame;
  frame.camera = "cam0";
  frame.width = kWidth;
  frame.height = kHeight;
  frame.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels));
  return frame;
}

void send(const Participant& participant, double seconds) {
  Writer<ImuSample> imu(participant, kTopic<ImuSample>);
  Writer<Frame> frames(participant, frameTopic("cam0"));
  WaitLoop loop(participant);
  Frame frame = noise();
  ImuSample sample;
  loop.every(kImuPeriod, [&] {
    sample.time = fromNanoseconds(nowNs());
    (void)imu.write(sample);
    ++sample.sequence;
  });
  loop.every(kFramePeriod, [&] {
    frame.stamp.captured_ns = nowNs();
    (void)frames.write(frame);
    ++frame.stamp.sequence;
  });
  loop.every(std::chrono::nanoseconds(std::int64_t(1e9 * seconds)), [&] { loop.stop(); });
  const double before = processorSeconds();
  loop.run();
  fmt::print("sender: {} samples, {} frames, {:.1f} ms of CPU a second\n", sample.sequence,
             frame.stamp.sequence, 1e3 * (processorSeconds() - before) / seconds);
}

struct Ages {
  std::vector<double> us;
  std::uint64_t first = 0, last = 0;
  void add(std::uint64_t sequence, std::int64_t sent_ns) {
    if (us.empty()) first = sequence;
    last = sequence;
    us.push_back(1e-3 * static_cast<double>(nowNs() - sent_ns));
  }
  void print(const char* what) {
    if (us.empty()) return fmt::print("{}: none came\n", what);
    std::sort(us.begin(), us.end());
    const auto at = [&](double share) { return us[std::size_t(share * double(us.size() - 1))]; };
    fmt::print("{}: {} of {} came, p50 {:.0f} us, p99 {:.0f} us\n", what, us.size(),
               last - first + 1, at(.5), at(.99));
  }
};

void receive(const Participant& participant, double seconds) {
  Reader<ImuSample> imu(participant, kTopic<ImuSample>);
  Reader<Frame> frames(participant, frameTopic("cam0"));
  WaitLoop loop(participant);
  Ages samples, images;
  const auto settled = Clock::now() + std::chrono::seconds(2);
  loop.on(imu, [&](const ImuSample& m) {
    if (Clock::now() > settled) samples.add(m.sequence, toNanoseconds(m.time));
  });
  loop.on(frames, [&](const Frame& m) {
    if (Clock::now() > settled) images.add(m.stamp.sequence, m.stamp.captured_ns);
  });
  loop.every(std::chrono::nanoseconds(std::int64_t(1e9 * seconds)), [&] { loop.stop(); });
  const double before = processorSeconds();
  loop.run();
  samples.print("imu");
  images.print("VGA");
  fmt::print("receiver: {:.1f} ms of CPU a second\n",
             1e3 * (processorSeconds() - before) / seconds);
}

}  // namespace
}  // namespace perdure::bus

int main(int argc, char** argv) {
  using namespace perdure::bus;
  const bool sends = argc == 3 && std::strcmp(argv[1], "send") == 0;
  if (argc != 3 || (!sends && std::strcmp(argv[1], "receive") != 0)) return 64;
  try {
    const Domain domain(settings());
    const Participant participant(domain, sends ? "capture" : "vio");
    (sends ? send : receive)(participant, std::atof(argv[2]));
    return 0;
  } catch (const perdure::StartupError& error) {
    std::cerr << error.what() << '\n';
    return static_cast<int>(error.code());
  }
}
