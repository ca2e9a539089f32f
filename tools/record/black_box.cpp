#include "tools/record/black_box.h"

#include <utility>

namespace perdure::tools {

BlackBox::BlackBox(double seconds, std::uint64_t most_bytes)
    : longest_ns_(static_cast<std::int64_t>(seconds * 1e9)), most_bytes_(most_bytes) {}

void BlackBox::add(PackedChunk chunk) {
  bytes_ += chunk.chunk.bytes();
  chunks_.push_back(std::move(chunk));
  // Drops the oldest chunk only if the second one is old enough, so that the rest still covers the
  // required time.
  const std::int64_t newest = chunks_.back().steady_ns;
  while (chunks_.size() > 2 && newest - chunks_[1].steady_ns >= longest_ns_) dropOldest();
  while (chunks_.size() > 1 && bytes_ > most_bytes_) {
    dropOldest();
    ++cut_short_;
  }
}

void BlackBox::dropOldest() {
  bytes_ -= chunks_.front().chunk.bytes();
  chunks_.pop_front();
}

std::deque<PackedChunk> BlackBox::take() {
  bytes_ = 0;
  return std::exchange(chunks_, {});
}

double BlackBox::seconds() const {
  if (chunks_.empty()) return 0;
  return 1e-9 * static_cast<double>(chunks_.back().steady_ns - chunks_.front().steady_ns);
}

std::optional<std::string> FaultWatch::onHealth(const Health& health, Time now) {
  Process& process = processes_[health.process];
  const bool was = process.state >= from_, is = health.state >= from_;
  process = {health.state, now};
  if (was || !is) return std::nullopt;
  const char* how = health.state == HealthState::kFailed ? " has failed" : " is degraded";
  return health.process + how + (health.message.empty() ? "" : ": " + health.message);
}

std::optional<std::string> FaultWatch::onSilent(std::size_t silent, Time now) {
  const bool more = silent > silent_;
  silent_ = silent;
  if (!more) return std::nullopt;
  constexpr std::chrono::milliseconds kLease(900);  // lease of health; its period is a second
  std::string name = "a process";
  Time oldest = now - kLease;
  for (const auto& [process, seen] : processes_) {
    if (seen.heard >= oldest) continue;
    oldest = seen.heard;
    name = process;
  }
  return name + " is silent";
}

}  // namespace perdure::tools
