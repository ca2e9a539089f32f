// A process that writes or reads images and prints one line of results: the number that came
// through shared memory, the bytes that it copied, and their age. perdure_frame_peer write|look
// COUNT SIDE MB [HOLD]
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <deque>
#include <fstream>
#include <iostream>
#include <thread>

#include "common/bus/wait_loop.h"

namespace {

std::atomic<std::uint64_t> copied_bytes{0};

}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// Counts the bytes that any library of this process copies in large pieces.
namespace {

constexpr std::size_t kLarge = 16 << 10;

[[gnu::optimize("O3", "no-tree-loop-distribute-patterns")]] void* copyUpwards(void* to,
                                                                              const void* from,
                                                                              std::size_t n) {
  if (n >= kLarge) copied_bytes += n;
  auto* t = static_cast<unsigned char*>(to);
  const auto* f = static_cast<const unsigned char*>(from);
  for (std::size_t i = 0; i < n; ++i) t[i] = f[i];
  return to;
}

}  // namespace

extern "C" [[gnu::optimize("no-tree-loop-distribute-patterns")]] void* memcpy(
    void* __restrict to, const void* __restrict from, std::size_t n) {
  return copyUpwards(to, from, n);
}

extern "C" [[gnu::optimize("no-tree-loop-distribute-patterns")]] void* memmove(void* to,
                                                                               const void* from,
                                                                               std::size_t n) {
  if (to <= from) return copyUpwards(to, from, n);
  if (n >= kLarge) copied_bytes += n;
  auto* t = static_cast<unsigned char*>(to);
  const auto* f = static_cast<const unsigned char*>(from);
  for (std::size_t i = n; i > 0; --i) t[i - 1] = f[i - 1];
  return to;
}
#endif

namespace perdure::bus {
namespace {

constexpr double kRate = 60.0;
constexpr std::chrono::seconds kSilence{2};  // after this time without an image the process ends

std::int64_t monotonicNs() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

/// All bytes have the value of the frame's number; the reader checks the first and last pixel.
Frame makeFrame(std::uint64_t sequence, std::uint32_t side) {
  Frame frame;
  frame.camera = "cam0";
  frame.width = frame.height = side;
  frame.stamp.sequence = sequence;
  frame.data = std::make_shared<const std::vector<std::uint8_t>>(
      std::size_t{side} * side, static_cast<std::uint8_t>(sequence));
  return frame;
}

std::uint64_t countOf(const auto& endpoint, const std::string& name) {
  ReasonCounts counts;
  endpoint.report(counts);
  return counts.of(name);
}

/// Whether an address lies in memory that several processes map.
bool isShared(const void* address) {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    if (line.find("/dev/shm/") == std::string::npos) continue;
    std::size_t dash = 0;
    const auto low = std::stoull(line, &dash, 16);
    const auto high = std::stoull(line.substr(dash + 1), nullptr, 16);
    const auto at = reinterpret_cast<std::uintptr_t>(address);
    if (at >= low && at < high) return true;
  }
  return false;
}

int write(const Participant& participant, int count, std::uint32_t side) {
  Writer<Frame> writer(participant, frameTopic("cam0"));
  const auto patience = std::chrono::steady_clock::now() + kSilence;
  while (writer.matched() == 0 && std::chrono::steady_clock::now() < patience) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  // The writer has discovered the reader, but the reader may not have discovered the writer yet.
  // Until then it receives nothing.
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  std::cout << "ready" << std::endl;
  std::uint64_t copied = 0, failed = 0;
  for (int i = 0; i < count; ++i) {
    Frame frame = makeFrame(static_cast<std::uint64_t>(i), side);
    const std::uint64_t before = copied_bytes;
    frame.stamp.captured_ns = monotonicNs();
    failed += !writer.write(frame);
    copied += copied_bytes - before;
    std::this_thread::sleep_for(std::chrono::duration<double>(1.0 / kRate));
  }
  (void)writer.waitForAcknowledgement(1.0);
  std::cout << fmt::format("wrote {} failed {} too_large {} used_up {} copies {:.2f}", count,
                           failed, countOf(writer, "frame_cam0_left_shared_memory_too_large"),
                           countOf(writer, "frame_cam0_left_shared_memory_used_up"),
                           static_cast<double>(copied) / count / side / side)
            << std::endl;
  return 0;
}

struct Seen {
  std::size_t got = 0, wrong = 0, gaps = 0, in_place = 0;
  std::uint64_t last = 0;
  std::vector<std::int64_t> ages_us;

  void add(const Frame& frame) {
    ages_us.push_back((monotonicNs() - frame.stamp.captured_ns) / 1000);
    const auto value = static_cast<std::uint8_t>(frame.stamp.sequence);
    wrong += frame.data->front() != value || frame.data->back() != value;
    gaps += got > 0 && frame.stamp.sequence != last + 1;
    in_place += isShared(frame.data->data());
    last = frame.stamp.sequence;
    ++got;
  }
  std::int64_t age(double share) {
    if (ages_us.empty()) return 0;
    std::sort(ages_us.begin(), ages_us.end());
    return ages_us[static_cast<std::size_t>(share * static_cast<double>(ages_us.size() - 1))];
  }
};

int look(const Participant& participant, int count, std::size_t hold) {
  Reader<Frame> reader(participant, frameTopic("cam0"));
  WaitLoop loop(participant);
  Seen seen;
  std::deque<Frame> held;
  std::uint64_t first_copied = 0;
  auto newest = std::chrono::steady_clock::now();
  loop.on(reader, [&](const Frame& frame) {
    seen.add(frame);
    if (seen.got == 1) first_copied = copied_bytes;
    held.push_back(frame);
    if (held.size() > hold) held.pop_front();
    newest = std::chrono::steady_clock::now();
  });
  std::cout << "ready" << std::endl;
  while (seen.got < static_cast<std::size_t>(count) &&
         std::chrono::steady_clock::now() - newest < kSilence) {
    loop.runOnce(std::chrono::milliseconds(100));
  }
  const double bytes = held.empty() ? 1.0 : static_cast<double>(held.back().data->size());
  const double copies = seen.got < 2 ? 0.0
                                     : static_cast<double>(copied_bytes - first_copied) / bytes /
                                           static_cast<double>(seen.got - 1);
  std::cout << fmt::format(
                   "got {} wrong {} gaps {} shared {} in_place {} copies {:.2f} p50 {} p99 {}",
                   seen.got, seen.wrong, seen.gaps, countOf(reader, "frame_cam0_in_shared_memory"),
                   seen.in_place, copies, seen.age(0.5), seen.age(0.99))
            << std::endl;
  for (const auto& [name, detail] : reader.firstDetails())
    std::cout << name << ": " << detail << std::endl;
  return 0;
}

}  // namespace
}  // namespace perdure::bus

int main(int argc, char** argv) {
  using namespace perdure::bus;
  if (argc < 5) return 64;
  Options options;
  options.shared_memory_mb = std::atoi(argv[4]);
  const Domain domain(options);
  const Participant participant(domain, argv[1]);
  std::cout << "shared memory: " << domain.sharedMemoryText() << std::endl;
  const int count = std::atoi(argv[2]);
  if (std::strcmp(argv[1], "write") == 0) {
    return write(participant, count, static_cast<std::uint32_t>(std::atoi(argv[3])));
  }
  return look(participant, count, argc > 5 ? static_cast<std::size_t>(std::atoi(argv[5])) : 1);
}
