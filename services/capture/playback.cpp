#include "services/capture/playback.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/types/health.h"
#include "services/capture/live/clocks.h"
#include "services/capture/run_file.h"

namespace perdure::capture {
namespace {

Duration periodOf(const Calibration& calibration) {
  const double rate = calibration.cameras.empty() ? 0.0 : calibration.cameras.front().rate_hz;
  return durationFromSeconds(rate > 0 ? 1.0 / rate : 0.1);
}

}  // namespace

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

Playback::Playback(service::Context& context, const Config& config)
    : context_(context),
      config_(config),
      drive_(openDrive(config, context.instance())),
      frame_count_(drive_->frameCount()),
      period_(periodOf(drive_->calibration())),
      resume_(readRunState(config)),
      drive_identity_(driveOf(config)),
      boot_(bootId()),
      gate_(context.participant(), config.start, std::chrono::steady_clock::now()) {
  Calibration calibration = drive_->calibration();
  if (config_.dataset.cameras == "mono" && calibration.cameras.size() > 1) {
    calibration.cameras.resize(1);
  }
  for (const CameraCalibration& camera : calibration.cameras) {
    frames_[camera.name] = &context_.writer(bus::frameTopic(camera.name));
  }
  outputs_ = outputs();
  (void)context_.writer(bus::kTopic<Calibration>).write(calibration);
  context_.on(bus::kTopic<Odometry>, [this](const Odometry& m) { credit("odometry", m.stamp); });
  context_.on(bus::kTopic<Detections>,
              [this](const Detections& m) { credit("detections", m.stamp); });
  context_.countReasons([this](ReasonCounts& counts) { report(counts); });
  context_.onHealth([this] { updateHealth(); });
  context_.loop().onWake([this] { pump(); });
  context_.every(std::chrono::milliseconds(2), [this] { pump(); });
}

Outputs Playback::outputs() {
  return {context_.sink(bus::kTopic<ImuSample>), context_.sink(bus::kTopic<SpeedSample>),
          [this](const Frame& frame) {
            const auto it = frames_.find(frame.camera);
            if (it != frames_.end() && it->second->write(frame) && frame.camera == "cam0") {
              context_.health().frameOut();
            }
          }};
}

void Playback::begin() {
  for (const std::string& name : gate_.missing()) reasons_.add("reader_missing_" + name);
  if (resume_) {
    context_.log().info("carries on at frame {} of {}", resume_->next_sequence, frame_count_);
  } else {
    context_.log().info("starts a drive of {} frames", frame_count_);
  }
  node_ = std::make_unique<Node>(config_, period_, resume_, outputs_);
  const auto isThere = [&](const std::string& name) {
    const auto in = [&](const auto& list) { return std::ranges::find(list, name) != list.end(); };
    return in(config_.start.readers) && !in(gate_.missing());
  };
  if (isThere("vio")) node_->expect("odometry");
  if (isThere("inference")) node_->expect("detections");
  if (resume_ && resume_->finished) return node_->end();
  loader_ =
      std::make_unique<Loader>(config_, std::move(drive_), resume_ ? resume_->next_sequence : 0,
                               [&loop = context_.loop()] { loop.wake(); });
}

void Playback::feed() {
  if (!node_->wants()) return;
  const bool ended = loader_->ended();  // before take(): true means that nothing follows
  if (auto message = loader_->take()) {
    if (std::holds_alternative<Frame>(*message)) {
      if (std::get<Frame>(*message).camera == "cam0") context_.health().frameIn();
    }
    node_->offer(*std::move(message));
  } else if (ended) {
    node_->end();
  }
}

void Playback::credit(const std::string& answerer, const FrameStamp& stamp) {
  if (!node_ || finished_) return;
  node_->onAnswer(answerer, stamp);
  saveState();
  pump();
}

void Playback::pump() {
  if (finished_ || !gate_.open(std::chrono::steady_clock::now())) return;
  if (!node_) begin();
  constexpr int kMost = 256;  // limit per call, so that Health and signals are served
  for (int i = 0; i < kMost && !context_.stopping(); ++i) {
    if (loader_) feed();
    if (node_->tick(HostClock::monotonicNs()) > Duration{0}) break;
    saveState();
  }
  if (node_->finished()) finish();
}

/// Writes the run state if it has changed. A sample alone does not cause a write, because readers
/// tolerate a few repeated samples after a restart.
void Playback::saveState() {
  RunState state = node_->state();
  if (config_.run.state.empty() || (state.next_sequence == saved_.next_sequence &&
                                    frames_saved_ == node_->framesGiven() && !finished_)) {
    return;
  }
  frames_saved_ = node_->framesGiven();
  saved_ = state;
  state.drive = drive_identity_;
  state.boot = boot_;
  state.finished = finished_;
  if (!writeRunState(config_.run.state, state)) reasons_.add("run_state_unwritable");
}

void Playback::finish() {
  finished_ = true;
  saveState();
  context_.log().info("end of drive after {} frames", node_->framesGiven());
  if (config_.run.on_end != "exit") return;
  // limit for all cameras together, because SIGTERM must end a service within a second
  const double longest = 0.5 / static_cast<double>(frames_.size());
  for (const auto& [camera, writer] : frames_) writer->waitForAcknowledgement(longest);
  context_.stop();
}

void Playback::updateHealth() {
  auto& health = context_.health();
  if (finished_) {
    health.state(HealthState::kOk, kEndOfDrive);
  } else if (!node_) {
    health.state(HealthState::kStarting,
                 fmt::format("waits for readers: {}", fmt::join(gate_.missing(), ", ")));
  } else {
    const std::string problem = loader_ ? loader_->lastProblem() : std::string();
    health.state(problem.empty() ? HealthState::kOk : HealthState::kDegraded, problem);
  }
}

void Playback::report(ReasonCounts& counts) const {
  counts.add(reasons_);
  if (node_) counts.add(node_->reasons());
  if (loader_) counts.add(loader_->reasons());
}

}  // namespace perdure::capture
