// Records the messages of capture and vio, one per line, for the test of live sensors in a guest.
// Each frame updates the time of the file TOUCHED.
// usage: guest_listener OUT TOUCHED
#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/os.h>
#include <sys/stat.h>
#include <time.h>

#include <limits>

#include "common/bus/wait_loop.h"
#include "common/service/signals.h"

namespace perdure {
namespace {

constexpr std::uint32_t kSquare = 8;  // pixels, side of a bit of the number in the image

std::int64_t read(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

/// Returns the lead of CLOCK_REALTIME over CLOCK_MONOTONIC in ns, from the fastest of several
/// readings.
std::int64_t wallAhead() {
  std::int64_t ahead = 0, least = std::numeric_limits<std::int64_t>::max();
  for (int i = 0; i < 20; ++i) {
    const std::int64_t before = read(CLOCK_MONOTONIC), wall = read(CLOCK_REALTIME);
    const std::int64_t took = read(CLOCK_MONOTONIC) - before;
    if (took >= least) continue;
    least = took;
    ahead = wall - before - took / 2;
  }
  return ahead;
}

/// Returns the number that the camera drew: 32 squares in the first rows, lowest bit first.
std::uint32_t numberIn(const Frame& frame) {
  const std::uint32_t channels = channelsOf(frame.encoding);
  const std::size_t row = std::size_t{frame.width} * (kSquare / 2) * channels;
  std::uint32_t number = 0;
  for (std::uint32_t bit = 0; bit < 32; ++bit) {
    const std::size_t at = row + (kSquare * bit + kSquare / 2) * channels;
    if (at < frame.data->size() && (*frame.data)[at] > 128) number |= 1U << bit;
  }
  return number;
}

std::string reasonsOf(const Health& health) {
  std::string text;
  for (const auto& [reason, n] : health.reasons) text += fmt::format("{}={} ", reason, n);
  return text;
}

class Notes {
 public:
  Notes(const char* path, const char* touched) : out_(fmt::output_file(path)), touched_(touched) {}

  void note(const Frame& f) {
    out_.print("frame {} {} {} {} {} {}\n", f.stamp.source, f.stamp.sequence,
               toNanoseconds(f.stamp.time), f.stamp.captured_ns, numberIn(f),
               read(CLOCK_MONOTONIC));
    const int file = open(touched_, O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
    if (file < 0) return;
    (void)futimens(file, nullptr);
    close(file);
  }
  void note(const ImuSample& s) {
    out_.print("imu {} {} {} {} {} {} {} {} {} {}\n", s.source, s.sequence, toNanoseconds(s.time),
               read(CLOCK_MONOTONIC), s.gyro[0], s.gyro[1], s.gyro[2], s.accel[0], s.accel[1],
               s.accel[2]);
  }
  void note(const Odometry& o) {
    out_.print("odometry {} {} {} {} {}\n", o.stamp.sequence, toNanoseconds(o.stamp.time),
               static_cast<int>(o.state), o.world.epoch, read(CLOCK_MONOTONIC));
  }
  void note(const Health& h) {
    out_.print("health {} {} {} {} {} {} {}|{}\n", h.process, static_cast<int>(h.state),
               h.frames_in, h.frames_out, h.dropped, read(CLOCK_MONOTONIC), reasonsOf(h),
               h.message);
  }
  void clocks() {
    out_.print("clocks {} {}\n", read(CLOCK_MONOTONIC), wallAhead());
    out_.flush();
  }

 private:
  fmt::ostream out_;
  const char* touched_;
};

template <class T>
void hear(bus::WaitLoop& loop, bus::Reader<T>& reader, Notes& notes) {
  loop.on(reader, [&notes](const T& message) { notes.note(message); });
}

void listen(const char* path, const char* touched) {
  const bus::Domain domain{bus::Options{}};
  const bus::Participant participant(domain, "guest_listener");
  bus::WaitLoop loop(participant);
  bus::Reader<Frame> frames(participant, bus::frameTopic("cam0"));
  bus::Reader<ImuSample> imu(participant, bus::kTopic<ImuSample>);
  bus::Reader<Odometry> odometry(participant, bus::kTopic<Odometry>);
  bus::Reader<Health> health(participant, bus::kTopic<Health>);
  Notes notes(path, touched);
  hear(loop, frames, notes);
  hear(loop, imu, notes);
  hear(loop, odometry, notes);
  hear(loop, health, notes);
  loop.every(std::chrono::milliseconds(500), [&notes] { notes.clocks(); });
  const service::BlockedSignals blocked;
  const service::SignalThread signals(blocked, [&loop] { loop.stop(); });
  loop.run();
}

}  // namespace
}  // namespace perdure

int main(int argc, char** argv) {
  if (argc != 3) return 64;
  perdure::listen(argv[1], argv[2]);
}
