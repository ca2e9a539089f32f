#include "services/ros2/core/clocks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

namespace perdure::ros2 {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::size_t kSeconds = 10;
constexpr char kElsewhere[] = "perdure";  ///< frames that did not come through the bridge

std::string spanText(std::int64_t ns) {
  return fmt::format("{:.6g} s", static_cast<double>(std::llabs(ns)) * 1e-9);
}

}  // namespace

void LeastDelay::observe(std::int64_t stamp_ns, std::int64_t now_ns) {
  const std::int64_t delay = now_ns - stamp_ns;
  if (settled_ && std::llabs(delay - static_cast<std::int64_t>(used_)) > kSecond) {
    ++jumps_;
    seconds_.clear();
    settled_ = false;
  }
  if (seconds_.empty()) first_ns_ = now_ns;
  if (seconds_.empty() || now_ns - seconds_.back().since_ns >= kSecond) {
    seconds_.push_back({now_ns, delay});
    if (seconds_.size() > kSeconds) seconds_.pop_front();
  }
  seconds_.back().least = std::min(seconds_.back().least, delay);
  const auto least = std::min_element(seconds_.begin(), seconds_.end(),
                                      [](auto& a, auto& b) { return a.least < b.least; });
  if (settled_) {
    // So slowly that the times of one input keep rising.
    constexpr double kSlew = 1e-3;
    const double step = kSlew * static_cast<double>(now_ns - last_ns_);
    used_ += std::clamp(static_cast<double>(least->least) - used_, -step, step);
  } else if (now_ns - first_ns_ >= kSecond / 2) {
    used_ = static_cast<double>(least->least);
    settled_ = true;
  }
  last_ns_ = now_ns;
}

std::optional<std::int64_t> LeastDelay::offset() const {
  return settled_ ? std::optional(static_cast<std::int64_t>(used_)) : std::nullopt;
}

void Clocks::addInput(const std::string& input, bool shared) { inputs_[input].shared = shared; }

void Clocks::observeCommon(TimePoint time, std::int64_t now_ns) {
  Input& input = inputs_[kElsewhere];
  if (reference_.empty()) reference_ = kElsewhere;
  const std::int64_t ns = toNanoseconds(time);
  input.delay.observe(ns, now_ns);
  input.last_offset_ns = now_ns - ns;
  input.last_heard_ns = now_ns;
}

Result<void> Clocks::requireSame(const std::string& name, std::int64_t offset_ns,
                                 std::int64_t now_ns) const {
  if (reference_.empty() || reference_ == name) return {};
  const Input& other = inputs_.at(reference_);
  if (now_ns - other.last_heard_ns > kSecond) return {};  // it may have jumped, too
  const std::int64_t apart = offset_ns - other.last_offset_ns;
  if (std::llabs(apart) <= apart_ns_) return {};
  return fail("stamp_elsewhere",
              fmt::format("stamps of {0} are {1} {2} those of {3}: two clocks. Let both drivers "
                          "stamp by one clock, or set in.{0}.clock: own",
                          name, spanText(apart), apart > 0 ? "behind" : "ahead of", reference_));
}

Result<std::int64_t> Clocks::onCommon(const std::string& name, Input& input, std::int64_t stamp_ns,
                                      std::int64_t now_ns) {
  if (input.shared) {
    if (const auto same = requireSame(name, now_ns - stamp_ns, now_ns); !same)
      return tl::unexpected(same.error());
    input.delay.observe(stamp_ns, now_ns);
    if (reference_.empty()) reference_ = name;
    return stamp_ns;
  }
  input.delay.observe(stamp_ns, now_ns);
  const bool others = std::any_of(inputs_.begin(), inputs_.end(),
                                  [](const auto& one) { return one.second.shared; });
  if (!others && reference_.empty()) reference_ = name;
  if (reference_ == name) return stamp_ns;
  const auto own = input.delay.offset();
  const auto common = reference_.empty() ? std::nullopt : inputs_.at(reference_).delay.offset();
  if (!own || !common) {
    return fail("clock_unknown", "how the clock of " + name +
                                     " lies to that of the other inputs is known half a second "
                                     "after both are heard");
  }
  return stamp_ns + *own - *common;
}

Result<TimePoint> Clocks::place(const std::string& name, const ros::Time& stamp,
                                std::int64_t now_ns) {
  Input& input = inputs_[name];
  if (stamp.sec == 0 && stamp.nanosec == 0) {
    return fail("stamp_missing", "messages of " + name +
                                     " have no stamp in their header; let the driver stamp them "
                                     "when they are taken");
  }
  if (stamp.sec < 0 || stamp.nanosec >= kSecond) {
    return fail("stamp_malformed", "stamps of " + name + " are no times; mend the driver");
  }
  const std::int64_t stamp_ns = stamp.sec * kSecond + stamp.nanosec;
  const auto time_ns = onCommon(name, input, stamp_ns, now_ns);
  if (!time_ns) return tl::unexpected(time_ns.error());
  input.last_offset_ns = now_ns - stamp_ns;
  input.last_heard_ns = now_ns;
  const TimePoint time = fromNanoseconds(*time_ns);
  // A driver that is started again, or a recording that is, begins anew.
  const bool anew = input.last && *input.last - time > Duration(kSecond);
  if (input.last && time <= *input.last && !anew) {
    return fail("stamp_not_newer", "a stamp of " + name + " is " +
                                       spanText(toNanoseconds(*input.last) - *time_ns) +
                                       " older than the one before; is the topic written twice?");
  }
  input.last = time;
  return time;
}

}  // namespace perdure::ros2
