// Plays a drive on the bus. It waits for readers, loads in advance, sends messages at their times,
// saves the state of the run, and reports progress in Health.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "common/service/service.h"
#include "services/capture/loader.h"
#include "services/capture/node.h"
#include "services/capture/start_gate.h"

namespace perdure::capture {

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
