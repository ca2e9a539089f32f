// Publishes the messages of a drive one by one, at their times (clock mode) or at the speed of the
// readers (follow mode).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/base/sink.h"
#include "common/replay/dataset.h"
#include "services/capture/config.h"
#include "services/capture/core/credits.h"
#include "services/capture/core/run_state.h"

namespace perdure::capture {

struct Outputs {
  Sink<ImuSample> imu;
  Sink<SpeedSample> speed;
  Sink<Frame> frame;
};

/// Single-threaded. `now_ns` is CLOCK_MONOTONIC as read by the caller; it never decreases.
class Node {
 public:
  /// `period`: usual time between frames. `resume`: state of an interrupted run, whose messages are
  /// not sent again. In clock mode, frames that were due during the interruption are counted as
  /// missed_while_away, and its inertial samples are sent late.
  Node(const Config& config, Duration period, const std::optional<RunState>& resume,
       Outputs outputs);

  /// Adds an answerer ("odometry", "detections"), whose answers credit frames in follow mode.
  void expect(const std::string& answerer) { credits_.expect(answerer); }
  void onAnswer(const std::string& answerer, const FrameStamp& stamp);

  bool wants() const { return !pending_ && !ended_; }
  void offer(replay::Message message) { pending_ = std::move(message); }
  void end() { ended_ = true; }

  /// Sends the pending message if it is due. Returns the time until the next call is needed;
  /// Duration::max(): none is needed before the next offer or answer.
  Duration tick(std::int64_t now_ns);

  bool finished() const { return ended_ && !pending_; }
  const RunState& state() const { return state_; }
  std::uint64_t framesGiven() const { return frames_given_; }
  const ReasonCounts& reasons() const { return reasons_; }

 private:
  Duration waitFor(TimePoint time, bool image, std::uint64_t sequence, std::int64_t now_ns);
  Duration waitForCredit(std::int64_t now_ns);
  bool isPast(TimePoint time, bool image, std::uint64_t sequence, std::int64_t now_ns);
  void give(std::int64_t now_ns);
  void giveFrame(Frame frame, std::int64_t now_ns);
  std::int64_t dueAt(TimePoint time) const;

  const Config config_;
  const Duration period_;
  const Outputs outputs_;
  const bool follow_;
  RunState state_;
  const RunState resumed_;
  bool begun_ = false, catching_up_ = false, ended_ = false;
  Credits credits_;
  std::optional<std::uint64_t> current_;  ///< sequence number of the last frame sent
  std::optional<std::int64_t> waiting_since_;
  std::optional<replay::Message> pending_;
  std::uint64_t frames_given_ = 0;
  ReasonCounts reasons_;
};

}  // namespace perdure::capture
