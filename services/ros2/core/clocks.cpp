#include "services/ros2/core/clocks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

namespace perdure::ros2 {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::size_t kSeconds = 10;
constexpr char kElsewhere[] = "perdure";  ///< input name of frames that other processes publish

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
  const auto least =
      std::ranges::min_element(seconds_, [](auto& a, auto& b) { return a.least < b.least; });
  if (settled_) {
    // The offset changes slowly, so that the times of one input keep increasing.
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

void Clocks::hear(Input& input, std::int64_t offset_ns, std::int64_t now_ns) const {
  if (input.heard_ns && near(offset_ns, input.offset_ns)) {
    if (!input.kept_ns || !near(*input.kept_ns, offset_ns)) input.kept_since_ns = *input.heard_ns;
    input.kept_ns = offset_ns;
  }
  input.offset_ns = offset_ns;
  input.heard_ns = now_ns;
}

bool Clocks::near(std::int64_t a_ns, std::int64_t b_ns) const {
  return std::llabs(a_ns - b_ns) <= apart_ns_;
}

void Clocks::observeCommon(TimePoint time, std::int64_t now_ns) {
  Input& input = inputs_[kElsewhere];
  const std::int64_t ns = toNanoseconds(time);
  hear(input, now_ns - ns, now_ns);
  input.delay.observe(ns, now_ns);
  if (reference_.empty() || reference_ == kElsewhere) {
    reference_ = kElsewhere;
    common_ns_ = now_ns - ns;
  }
}

std::vector<std::string> Clocks::keepersOf(std::int64_t offset_ns, std::int64_t now_ns) const {
  std::vector<std::string> keepers;
  for (const auto& [name, input] : inputs_) {
    if (input.shared && input.kept_ns && now_ns - *input.heard_ns <= kSecond &&
        near(*input.kept_ns, offset_ns))
      keepers.push_back(name);
  }
  return keepers;
}

Reason Clocks::elsewhere(const std::string& name, std::int64_t offset_ns,
                         std::int64_t now_ns) const {
  std::vector<std::string> others = keepersOf(*common_ns_, now_ns);
  std::erase(others, name);
  const std::int64_t apart = offset_ns - *common_ns_;
  const std::string span = spanText(apart) + (apart > 0 ? " behind" : " ahead of");
  if (others.empty()) {
    return {"stamp_elsewhere", "stamps of " + name + " are " + span +
                                   " those before: was the clock set, or are there two drivers?"};
  }
  return {"stamp_elsewhere",
          fmt::format("stamps of {0} are {1} those of {2}: two clocks. Let both drivers "
                      "stamp by one clock, or set in.{0}.clock: own",
                      name, span, others.front())};
}

Result<void> Clocks::requireCommon(const std::string& name, std::int64_t offset_ns,
                                   std::int64_t now_ns) {
  if (common_ns_ && near(*common_ns_, offset_ns)) {
    common_ns_ = offset_ns;
    return {};
  }
  const std::vector<std::string> keepers = keepersOf(offset_ns, now_ns);
  const bool kept_long = std::ranges::any_of(keepers, [&](const std::string& one) {
    return now_ns - inputs_.at(one).kept_since_ns >= kSecond / 2;
  });
  const bool nobody_else =
      std::ranges::count_if(inputs_, [](const auto& one) { return one.second.shared; }) == 1;
  const std::size_t before = common_ns_ ? keepersOf(*common_ns_, now_ns).size() : 0;
  if ((keepers.size() > 1 || kept_long || nobody_else) && keepers.size() > before) {
    common_ns_ = offset_ns;
    reference_ = name;
    return {};
  }
  if (common_ns_) return tl::unexpected(elsewhere(name, offset_ns, now_ns));
  return fail("clock_unknown");  // temporary, so without an explanation
}

Result<std::int64_t> Clocks::onCommon(const std::string& name, Input& input, std::int64_t stamp_ns,
                                      std::int64_t now_ns) {
  if (input.shared) {
    if (const auto common = requireCommon(name, now_ns - stamp_ns, now_ns); !common)
      return tl::unexpected(common.error());
    input.delay.observe(stamp_ns, now_ns);
    return stamp_ns;
  }
  input.delay.observe(stamp_ns, now_ns);
  const bool others =
      std::ranges::any_of(inputs_, [](const auto& one) { return one.second.shared; });
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
    return fail("stamp_malformed", "stamps of " + name + " are not times; fix the driver");
  }
  const std::int64_t stamp_ns = stamp.sec * kSecond + stamp.nanosec;
  hear(input, now_ns - stamp_ns, now_ns);
  const auto time_ns = onCommon(name, input, stamp_ns, now_ns);
  if (!time_ns) return tl::unexpected(time_ns.error());
  const TimePoint time = fromNanoseconds(*time_ns);
  // A restarted driver or recording may start at an earlier time.
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
