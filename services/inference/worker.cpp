#include "services/inference/worker.h"

#include <fmt/format.h>

namespace perdure::inference {
namespace {

constexpr std::int32_t kAbove = 10;  // margin of the leader's strength above all others
constexpr std::int32_t kMostStrength = 1'000'000'000;

Ownership firstOwnership(const OwnershipConfig& config, Duration lease) {
  return config.probation_s > 0 ? Ownership::unheard(lease)
                                : Ownership(config.strength, config.standby, lease);
}

}  // namespace

Worker::Worker(Node& node, const OwnershipConfig& ownership, double budget_ms, WorkerBus bus,
               service::HealthMeter& health, std::function<void()> end)
    : node_(node),
      budget_ms_(budget_ms),
      budget_(budget_ms, node.sizeShares()),
      lease_(durationFromSeconds(leaseSeconds(ownership))),
      bus_(bus),
      health_(health),
      end_(std::move(end)),
      ownership_(firstOwnership(ownership, lease_)),
      swap_({node.model().instance, node.model().name, ownership.probation_s, lease_}) {
  publishModel();
  node_.timeBy(
      [] { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); });
  thread_ = std::thread([this] { run(); });
}

Worker::~Worker() {
  queue_.close();
  thread_.join();
}

std::int32_t Worker::firstStrength(const OwnershipConfig& ownership) {
  return static_cast<std::int32_t>(firstOwnership(ownership, Duration{}).strength());
}

void Worker::offer(const Frame& frame) {
  health_.frameIn();
  queue_.push({frame, Clock::now()});
  health_.setDropped(queue_.dropped());
}

void Worker::expect(const Predictions& predictions) {
  const std::lock_guard lock(mutex_);
  expected_ = predictions;
}

void Worker::onCalibration(const perdure::Calibration& calibration) {
  const std::lock_guard lock(mutex_);
  calibration_ = calibration;
}

void Worker::onOdometry(const Odometry& odometry) {
  const std::lock_guard lock(mutex_);
  odometry_ = odometry;
}

void Worker::publishModel() {
  swap_.learn(node_.model());
  (void)bus_.models.write(node_.model());
}

Result<Detections> Worker::look(const Frame& frame) {
  Predictions expected;
  {
    const std::lock_guard lock(mutex_);
    expected = expected_;
    if (const auto new_one = std::exchange(calibration_, {})) node_.onCalibration(*new_one);
    if (const auto new_one = std::exchange(odometry_, {})) node_.onOdometry(*new_one);
    if (!expected.predictions.empty() && !fitsFrame(expected, frame)) {
      reasons_.add("predictions_stale");
    }
  }
  const std::uint64_t before = node_.model().hash;
  const auto result = node_.infer(frame, expected);
  if (node_.model().hash == before) return result;
  const std::lock_guard lock(mutex_);
  publishModel();
  return result;
}

void Worker::assertAlive() {
  const auto now = Clock::now();
  noteLapse(now);
  const auto busy = busy_since_.load();
  if (busy != Clock::time_point::max() && now - busy > lease_) return;
  last_alive_ = now;
  const std::lock_guard lock(mutex_);
  if (silent_) return;
  bus_.detections.assertLiveliness();
  swap_.tick(now);
  obey();
}

bool Worker::goesOn(Duration longest) const {
  const auto busy = busy_since_.load();
  return busy == Clock::time_point::max() || Clock::now() - busy <= longest;
}

void Worker::heard(const Detections& detections) {
  const std::lock_guard lock(mutex_);
  swap_.heard(detections, Clock::now());
  obey();
}

void Worker::told(const SwapNotice& notice) {
  const std::lock_guard lock(mutex_);
  swap_.told(notice, Clock::now());
  obey();
}

void Worker::learn(const ModelInfo& model) {
  const std::lock_guard lock(mutex_);
  swap_.learn(model);
}

/// Counts a lapse if the last sign of life is older than the lease, because DDS may not yet have
/// reported the loss after a suspension.
void Worker::noteLapse(Clock::time_point now) {
  if (now - last_alive_.load() > lease_) ++lapses_;
}

void Worker::run() {
  while (const auto job = queue_.pop()) {
    busy_since_ = Clock::now();
    const auto result = look(job->frame);
    const Clock::time_point now = Clock::now();
    {
      const std::lock_guard lock(mutex_);
      age_ms_ = std::chrono::duration<double, std::milli>(now - job->since).count();
    }
    keepBudget(std::chrono::duration<double, std::milli>(now - busy_since_.load()).count());
    if (result) {
      publish(*result, now - job->since);
    } else {
      noteFailure(result.error());
    }
    busy_since_ = Clock::time_point::max();
  }
}

void Worker::keepBudget(double ms) {
  const std::size_t before = budget_.size();
  if (!budget_.took(ms)) return;
  node_.useSize(budget_.size());
  const std::lock_guard lock(mutex_);
  reasons_.add(budget_.size() > before ? "input_smaller" : "input_larger");
  scale_ = node_.inputScale();
}

void Worker::noteFailure(const Reason& reason) {
  const std::lock_guard lock(mutex_);
  reasons_.add(reason);
  last_problem_ = reason.code + ": " + reason.detail;
  if (reason.code == "frame_malformed") return;  // this is an error of capture, not of the network
  const auto now = Clock::now();
  if (ownership_.noteFailure(now)) {
    reasons_.add("form_lost");
    adoptStrength(now);
    bus_.detections.release();  // a later result would also inform readers, but may take long
  }
  swap_.ownFailure(reason);
  obey();
}

void Worker::adoptStrength(Clock::time_point now) {
  const auto strength = static_cast<std::int32_t>(ownership_.strength());
  if (strength == bus_.detections.strength()) return;
  // DDS sends a change of strength separately from the data. Later data may arrive before it.
  if (strength < bus_.detections.strength() && bus_.rivals.matched() > 1)
    hold_until_ = now + lease_;
  bus_.detections.setStrength(strength);
}

void Worker::publish(const Detections& detections, Duration age) {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  noteLapse(now);
  if (silent_) return;
  const bool was_in_form = ownership_.inForm();
  ownership_.strengthFor(now, age, bus_.detections.livelinessLost() + lapses_.load(),
                         swap_.alone(now));
  adoptStrength(now);
  if (was_in_form != ownership_.inForm()) {
    reasons_.add(ownership_.inForm() ? "form_regained" : "form_lost");
  }
  swap_.ownResult(detections, ownership_.inForm(), now);
  obey();
  if (silent_) return;
  if (now < hold_until_) return reasons_.add("held_back");
  if (bus_.detections.write(detections)) health_.frameOut();
  last_alive_ = Clock::now();  // a write also asserts liveliness
}

void Worker::obey() {
  const Swap::Actions actions = swap_.take();
  if (actions.lead) {
    const std::int32_t others = bus_.rivals.strongestBut(bus_.detections).value_or(0);
    ownership_.lead(std::max(std::min(others, kMostStrength) + kAbove, bus_.detections.strength()));
    bus_.detections.setStrength(static_cast<std::int32_t>(ownership_.strength()));
    hold_until_ = {};
  }
  if (actions.yield) {
    silent_ = true;
    bus_.detections.setStrength(static_cast<std::int32_t>(Ownership::kOutOfForm - 1));
    bus_.detections.release();
  }
  for (const Detections& d : actions.again) {
    if (silent_) break;
    if (bus_.detections.write(d)) reasons_.add("said_again");
  }
  for (const SwapNotice& notice : actions.notices) (void)bus_.notices.write(notice);
  if (!actions.end) return;
  failure_ = actions.failure;
  end_();
}

void Worker::report(ReasonCounts& counts) const {
  const std::lock_guard lock(mutex_);
  for (const auto& [reason, n] : reasons_.all()) counts.add(reason, n);
  for (const auto& [reason, n] : swap_.reasons().all()) counts.add(reason, n);
}

/// Returns a sentence about the reduction of the input by the time budget; empty if there is none.
std::string Worker::reducedInput() const {
  if (scale_ == 1.0) return "";
  return fmt::format(
      "the input is {:.0f} % of its width, for the budget of {:.0f} ms; the last result was "
      "{:.0f} ms old",
      100.0 * scale_, budget_ms_, age_ms_);
}

std::pair<HealthState, std::string> Worker::state() const {
  const std::lock_guard lock(mutex_);
  if (!failure_.empty()) return {HealthState::kFailed, failure_};
  if (!ownership_.inForm()) {
    return {HealthState::kDegraded,
            last_problem_.empty()
                ? "results came later than the lease: give it a core of its own, a smaller "
                  "network, or a longer ownership.period_s"
                : last_problem_};
  }
  if (ownership_.spare())
    return {HealthState::kOk, "stands by: another one took over and is heard"};
  if (!swap_.message().empty()) return {HealthState::kOk, swap_.message()};
  return {HealthState::kOk, last_problem_.empty() ? reducedInput() : last_problem_};
}

std::string Worker::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

}  // namespace perdure::inference
