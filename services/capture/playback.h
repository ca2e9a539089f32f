// Plays a drive on the bus. It waits for readers, loads in advance, sends messages at their times,
// saves the state of the run, and reports progress in Health.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/bus/discovery.h"
#include "common/service/service.h"
#include "services/capture/loader.h"
#include "services/capture/node.h"

namespace perdure::capture {

/// Waits for the readers that must receive the first frame. vio and inference count as present if
/// they read frame/cam0, other processes if they read any topic.
class StartGate {
 public:
  using Clock = std::chrono::steady_clock;
  StartGate(const bus::Participant& participant, const StartConfig& config, Clock::time_point now);

  /// Returns whether the drive may start: half a second after all readers are present, so that they
  /// also discover this process, or after the timeout. Once true, the result stays true.
  bool open(Clock::time_point now);
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

class Playback {
 public:
  /// Opens the drive and publishes its calibration. Throws StartupError.
  Playback(service::Context& context, const Config& config);

 private:
  void begin();
  void pump();
  void feed();
  void credit(const std::string& answerer, const FrameStamp& stamp);
  void saveState();
  void finish();
  void updateHealth();
  void report(ReasonCounts& counts) const;
  Outputs outputs();

  service::Context& context_;
  const Config config_;
  std::unique_ptr<replay::Dataset> drive_;  ///< owned until the loader takes it
  std::size_t frame_count_ = 0;
  Duration period_{0};
  std::optional<RunState> resume_;
  const std::string drive_identity_, boot_;
  RunState saved_;
  std::uint64_t frames_saved_ = 0;
  StartGate gate_;
  std::map<std::string, bus::Writer<Frame>*> frames_;
  Outputs outputs_;
  std::unique_ptr<Node> node_;
  std::unique_ptr<Loader> loader_;
  ReasonCounts reasons_;
  bool finished_ = false;
};

}  // namespace perdure::capture
