// The state of each process. Every process publishes it, keyed by process.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "common/base/check.h"
#include "common/base/ids.h"
#include "common/types/description.h"

namespace perdure {

enum class HealthState : std::uint8_t { kStarting = 0, kOk = 1, kDegraded = 2, kFailed = 3 };

struct Health {
  std::string process;  ///< "capture", "vio", …; the key, together with the vehicle
  InstanceId instance = 0;
  std::uint32_t pid = 0;
  HealthState state = HealthState::kStarting;
  std::string message;  ///< one sentence: the fault and its fix, or the cause of waiting
  std::uint64_t frames_in = 0, frames_out = 0, dropped = 0;
  double rate_hz = 0.0;  ///< rate of frames_out, over the last seconds
  double cpu_s = 0.0;    ///< processor time since the start
  std::uint64_t rss_bytes = 0;
  std::map<std::string, std::uint64_t> reasons;  ///< counted reasons, including those of DDS
};

inline const char* nameOf(HealthState state) {
  constexpr std::array kNames{"starting", "ok", "degraded", "failed"};
  return nameAt(kNames, state);
}

/// Health::message of capture after the last frame of a drive.
inline constexpr char kEndOfDrive[] = "end of drive";
/// A reason in Health, set if the silence of inputs is the only cause of the degraded state.
inline constexpr char kInputSilent[] = "input_silent";

/// Returns whether the end of the drive is the only fault. `capture` is null if none was received.
inline bool endedWith(const Health* capture, const Health& health) {
  return capture != nullptr && capture->message == kEndOfDrive &&
         health.state == HealthState::kDegraded && health.reasons.contains(kInputSilent);
}

}  // namespace perdure

namespace perdure::wire {

void describe(auto& a, Is<Health> auto& d, auto& w) {
  a.name("process", d.process, w.process);
  a.value("instance", d.instance, w.source);
  a.value("pid", d.pid, w.pid);
  a.choice("state", d.state, w.state, HealthState::kFailed);
  a.text("message", d.message, w.message, kTextLength);
  a.value("frames_in", d.frames_in, w.frames_in);
  a.value("frames_out", d.frames_out, w.frames_out);
  a.value("dropped", d.dropped, w.dropped);
  a.number("rate_hz", d.rate_hz, w.rate_hz, kNotNegative);
  a.number("cpu_s", d.cpu_s, w.cpu_s, kNotNegative);
  a.value("rss_bytes", d.rss_bytes, w.rss_bytes);
  a.counts("reasons", d.reasons, w.reasons, kReasons);
}

}  // namespace perdure::wire
