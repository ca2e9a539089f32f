#include "services/inference/worker.h"

namespace perdure::inference {

Worker::Worker(Node& node, const OwnershipConfig& ownership, bus::Writer<Detections>& writer,
               const bus::RawReader& rivals, service::HealthMeter& health)
    : node_(node),
      lease_(durationFromSeconds(leaseSeconds(ownership))),
      ownership_(ownership.strength, ownership.standby, lease_),
      writer_(writer),
      rivals_(rivals),
      health_(health) {
  thread_ = std::thread([this] { run(); });
}

Worker::~Worker() {
  queue_.close();
  thread_.join();
}

void Worker::offer(const Frame& frame) {
  health_.frameIn();
  queue_.push({frame, Clock::now()});
  health_.setDropped(queue_.dropped());
}

void Worker::assertAlive() {
  const auto now = Clock::now();
  noteLapse(now);
  const auto busy = busy_since_.load();
  if (busy != Clock::time_point::max() && now - busy > lease_) return;
  last_alive_ = now;
  writer_.assertLiveliness();
}

/// A process that was stopped cannot have said that it lives; DDS may not yet have told it so.
void Worker::noteLapse(Clock::time_point now) {
  if (now - last_alive_.load() > lease_) ++lapses_;
}

void Worker::run() {
  while (const auto job = queue_.pop()) {
    busy_since_ = Clock::now();
    const auto result = node_.infer(job->frame);
    if (result) {
      publish(*result, Clock::now() - job->since);
    } else {
      const std::lock_guard lock(mutex_);
      reasons_.add(result.error());
      last_problem_ = result.error().code + ": " + result.error().detail;
    }
    busy_since_ = Clock::time_point::max();
  }
}

void Worker::publish(const Detections& detections, Duration age) {
  const auto now = Clock::now();
  noteLapse(now);
  const auto strength = static_cast<std::int32_t>(
      ownership_.strengthFor(now, age, writer_.livelinessLost() + lapses_.load()));
  // A change of strength travels apart from the data: what is written with it may overtake it.
  if (strength < writer_.strength() && rivals_.matched() > 1) hold_until_ = now + lease_;
  if (strength != writer_.strength()) writer_.setStrength(strength);
  if (in_form_ != ownership_.inForm()) {
    in_form_ = ownership_.inForm();
    count(in_form_ ? "form_regained" : "form_lost");
  }
  if (now < hold_until_) return count("held_back");
  if (writer_.write(detections)) health_.frameOut();
  last_alive_ = Clock::now();  // a write says "I live" too
}

void Worker::count(const char* code) {
  const std::lock_guard lock(mutex_);
  reasons_.add(code);
}

void Worker::report(ReasonCounts& counts) const {
  const std::lock_guard lock(mutex_);
  for (const auto& [reason, n] : reasons_.all()) counts.add(reason, n);
}

std::string Worker::lastProblem() const {
  const std::lock_guard lock(mutex_);
  return last_problem_;
}

}  // namespace perdure::inference
