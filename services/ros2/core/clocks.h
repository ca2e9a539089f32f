// The stamps of several drivers on one clock: that which most of them keep to.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/base/time.h"
#include "common/ros/messages.h"

namespace perdure::ros2 {

/// The least of arrival − stamp in the last ten seconds: what comes late by a varying time was at
/// times not late.
class LeastDelay {
 public:
  void observe(std::int64_t stamp_ns, std::int64_t now_ns);
  /// Nothing in the first half second.
  std::optional<std::int64_t> offset() const;
  std::uint64_t jumps() const { return jumps_; }

 private:
  struct Second {
    std::int64_t since_ns, least;
  };
  std::deque<Second> seconds_;
  std::int64_t first_ns_ = 0, last_ns_ = 0;
  double used_ = 0.0;
  bool settled_ = false;
  std::uint64_t jumps_ = 0;
};

class Clocks {
 public:
  /// `apart`: stamps that are of one clock come no further apart than that.
  explicit Clocks(Duration apart) : apart_ns_(apart.count()) {}

  /// `shared`: its stamps are of the common clock. Each input once, before its stamps.
  void addInput(const std::string& input, bool shared);

  /// The stamp on the common clock; `now_ns` is when it came. Times of one input rise. Reasons:
  /// stamp_missing, stamp_malformed, stamp_elsewhere (of another clock than the others'),
  /// stamp_not_newer, clock_unknown (no common clock yet, or an own clock that cannot be placed
  /// yet).
  ///
  /// A clock becomes the common one when two inputs keep to it, or one for half a second or without
  /// others, and fewer keep to that which was. So one wrong stamp, first or later, moves nothing.
  Result<TimePoint> place(const std::string& input, const ros::Time& stamp, std::int64_t now_ns);
  /// A time of the common clock itself, from another source.
  void observeCommon(TimePoint time, std::int64_t now_ns);

 private:
  struct Input {
    bool shared = true;
    LeastDelay delay;
    std::int64_t offset_ns = 0;                 ///< arrival − stamp, of the last stamp
    std::optional<std::int64_t> heard_ns = {};  ///< when it came
    /// What two stamps in a row agree on, and since when.
    std::optional<std::int64_t> kept_ns = {};
    std::int64_t kept_since_ns = 0;
    std::optional<TimePoint> last = {};  ///< on the common clock
  };
  Result<std::int64_t> onCommon(const std::string& name, Input& input, std::int64_t stamp_ns,
                                std::int64_t now_ns);
  Result<void> requireCommon(const std::string& name, std::int64_t offset_ns, std::int64_t now_ns);
  void hear(Input& input, std::int64_t offset_ns, std::int64_t now_ns) const;
  bool near(std::int64_t a_ns, std::int64_t b_ns) const;
  /// The shared inputs, heard in the last second, that keep to this offset.
  std::vector<std::string> keepersOf(std::int64_t offset_ns, std::int64_t now_ns) const;
  Reason elsewhere(const std::string& name, std::int64_t offset_ns, std::int64_t now_ns) const;

  std::int64_t apart_ns_;
  std::map<std::string, Input> inputs_;
  std::optional<std::int64_t>
      common_ns_;          ///< arrival − stamp by the common clock, the last there is
  std::string reference_;  ///< the input whose delay tells where the common clock is
};

}  // namespace perdure::ros2
