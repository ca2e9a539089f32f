#include "services/capture/start_gate.h"

#include "common/base/time.h"

namespace perdure::capture {

StartGate::StartGate(const bus::Participant& participant, const StartConfig& config,
                     Clock::time_point now)
    : discovery_(participant),
      frames_(participant.wireName("frame/cam0")),
      config_(config),
      since_(now),
      missing_(config.readers),
      open_(config.readers.empty()) {}

std::set<std::string> StartGate::present() {
  std::set<std::string> names;
  for (const bus::RemoteEndpoint& endpoint : discovery_.endpoints()) {
    const bool wants_frames = endpoint.process == "vio" || endpoint.process == "inference";
    if (endpoint.writer || (wants_frames && endpoint.wire_name != frames_)) continue;
    names.insert(endpoint.process);
  }
  return names;
}

bool StartGate::open(Clock::time_point now) {
  if (open_) return true;
  constexpr std::chrono::milliseconds kSettle{500};
  const std::set<std::string> names = present();
  missing_.clear();
  for (const std::string& reader : config_.readers) {
    if (!names.contains(reader)) missing_.push_back(reader);
  }
  if (!missing_.empty()) complete_since_ = Clock::time_point::max();
  if (missing_.empty() && complete_since_ == Clock::time_point::max()) complete_since_ = now;
  const bool settled =
      complete_since_ != Clock::time_point::max() && now - complete_since_ >= kSettle;
  open_ = settled || now - since_ >= durationFromSeconds(config_.timeout_s);
  return open_;
}

}  // namespace perdure::capture
