// Waits for the readers that must receive the first frame.
#pragma once

#include <chrono>
#include <set>
#include <string>
#include <vector>

#include "common/bus/discovery.h"
#include "services/capture/config.h"

namespace perdure::capture {

/// A process counts as present if it reads frame/cam0 (vio, inference), or any topic (others).
class StartGate {
 public:
  using Clock = std::chrono::steady_clock;
  StartGate(const bus::Participant& participant, const StartConfig& config, Clock::time_point now);

  /// Opens half a second after all readers are present, so that they discover this process too, or
  /// after the timeout. It then stays open.
  bool open(Clock::time_point now);
  /// Names of the absent readers.
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
