#include "services/capture/node.h"

#include <algorithm>

namespace perdure::capture {
namespace {

TimePoint stampOf(const replay::Message& message) {
  if (const auto* frame = std::get_if<Frame>(&message)) return frame->stamp.time;
  if (const auto* imu = std::get_if<ImuSample>(&message)) return imu->time;
  return std::get<SpeedSample>(message).time;
}

}  // namespace

Node::Node(const Config& config, Duration period, const std::optional<RunState>& resume,
           Outputs outputs)
    : config_(config),
      period_(period),
      outputs_(std::move(outputs)),
      follow_(config.pace.mode == "follow"),
      state_(resume.value_or(RunState{})),
      resumed_(state_),
      begun_(resume.has_value()),
      catching_up_(resume.has_value()),
      credits_(static_cast<std::size_t>(config.pace.window)) {}

std::int64_t Node::dueAt(TimePoint time) const {
  const double drive_ns = static_cast<double>(toNanoseconds(time) - state_.origin_ns);
  return state_.start_ns + static_cast<std::int64_t>(drive_ns / config_.pace.rate);
}

/// Returns whether an earlier process has sent the message, or its time passed while no process
/// ran.
bool Node::isPast(TimePoint time, bool image, std::uint64_t sequence, std::int64_t now_ns) {
  if (!catching_up_) return false;
  if (!image) return toNanoseconds(time) <= resumed_.last_ns;
  if (sequence < resumed_.next_sequence) return true;
  const auto late = static_cast<double>(now_ns - dueAt(time)) * config_.pace.rate;
  if (!follow_ && late > static_cast<double>(period_.count())) {
    if (!current_ || *current_ != sequence) reasons_.add("missed_while_away");
    current_ = sequence;
    return true;
  }
  catching_up_ = false;
  return false;
}

Duration Node::waitForCredit(std::int64_t now_ns) {
  if (credits_.maySend()) {
    waiting_since_.reset();
    return Duration{0};
  }
  if (!waiting_since_) waiting_since_ = now_ns;
  const Duration left =
      durationFromSeconds(config_.pace.timeout_s) - Duration(now_ns - *waiting_since_);
  if (left > Duration{0}) return left;
  reasons_.add("answer_timeout");
  credits_.giveUp();
  waiting_since_.reset();
  return Duration{0};
}

Duration Node::waitFor(TimePoint time, bool image, std::uint64_t sequence, std::int64_t now_ns) {
  if (!follow_) return std::max(Duration{0}, Duration(dueAt(time) - now_ns));
  const bool new_frame = image && (!current_ || *current_ != sequence);
  return new_frame ? waitForCredit(now_ns) : Duration{0};
}

Duration Node::tick(std::int64_t now_ns) {
  if (!pending_) return Duration::max();
  const TimePoint time = stampOf(*pending_);
  const auto* frame = std::get_if<Frame>(&*pending_);
  const std::uint64_t sequence = frame ? frame->stamp.sequence : 0;
  if (!begun_) {
    begun_ = true;
    state_.start_ns = now_ns;
    state_.origin_ns = toNanoseconds(time);
  }
  if (isPast(time, frame != nullptr, sequence, now_ns)) {
    pending_.reset();
    return Duration{0};
  }
  const Duration wait = waitFor(time, frame != nullptr, sequence, now_ns);
  if (wait > Duration{0}) return wait;
  give(now_ns);
  return Duration{0};
}

void Node::give(std::int64_t now_ns) {
  replay::Message message = *std::move(pending_);
  pending_.reset();
  state_.last_ns = std::max(state_.last_ns, toNanoseconds(stampOf(message)));
  if (auto* frame = std::get_if<Frame>(&message)) {
    giveFrame(std::move(*frame), now_ns);
  } else if (const auto* imu = std::get_if<ImuSample>(&message)) {
    outputs_.imu(*imu);
  } else {
    outputs_.speed(std::get<SpeedSample>(message));
  }
}

void Node::giveFrame(Frame frame, std::int64_t now_ns) {
  const std::uint64_t sequence = frame.stamp.sequence;
  const bool first_of_pair = !current_ || *current_ != sequence;
  if (!follow_ && now_ns - dueAt(frame.stamp.time) > period_.count()) reasons_.add("late");
  frame.stamp.captured_ns = now_ns;
  outputs_.frame(frame);
  if (!first_of_pair) return;
  ++frames_given_;
  current_ = sequence;
  credits_.sent(sequence);
  state_.next_sequence = follow_ ? credits_.firstOpen(sequence + 1) : sequence + 1;
}

void Node::onAnswer(const std::string& answerer, const FrameStamp& stamp) {
  if (!follow_ || !current_ || stamp.sequence > *current_) return;
  credits_.credit(answerer, stamp.sequence);
  state_.next_sequence = credits_.firstOpen(*current_ + 1);
}

}  // namespace perdure::capture
