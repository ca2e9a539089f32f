// Waits for the readers that must not miss the first frame.
#pragma once

#include <chrono>
#include <set>
#include <string>
#include <vector>

#include "common/bus/discovery.h"
#include "services/capture/config.h"

namespace perdure::capture {

/// A process reads when it has a reader of frame/cam0 (vio, inference) or of any topic (others).
class StartGate {
 public:
  using Clock = std::chrono::steady_clock;
  StartGate(const bus::Participant& participant, const StartConfig& config, Clock::time_point now);

  /// Open when all are there, and half a second more so that they know of us too; or when the
  /// time is up. Stays open.
  bool open(Clock::time_point now);
  /// Names of those that are not there yet.
  const std::vector<std::string>& missing() const { return missing_; }

 private:
  std::set<std::string> present();

  bus::Discovery discovery_;
  const std::string frames_;
  const StartConfig config_;
  const Clock::time_point since_;
  Clock::time_point complete_since_ = Clock::time_point::max();
  std::vector<std::string> missing_;
  bool open_ = false;
};

}  // namespace perdure::capture
