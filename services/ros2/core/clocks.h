// Converts the stamps of several drivers to one common clock: the clock that most of them use.
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

/// Estimates a clock's offset: the smallest difference arrival − stamp in the last ten seconds.
class LeastDelay {
 public:
  void observe(std::int64_t stamp_ns, std::int64_t now_ns);
  /// Returns the offset in ns, or nothing in the first half second.
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
  /// `apart`: stamps are on the same clock if their arrival − stamp differ by at most this time.
  explicit Clocks(Duration apart) : apart_ns_(apart.count()) {}

  /// Adds an input; call it once, before its first stamp. `shared`: its stamps should be on the
  /// common clock.
  void addInput(const std::string& input, bool shared);

  /// Converts a stamp to the common clock; `now_ns` is its time of arrival. The results for one
  /// input increase. Fails with stamp_missing, stamp_malformed, stamp_elsewhere (on another clock
  /// than the other inputs) or stamp_not_newer. It fails with clock_unknown if there is no common
  /// clock yet, or if the offset of an own clock is not known yet.
  ///
  /// A clock becomes the common one if two inputs agree on it, if one input keeps it for half a
  /// second, or if there is only one input. More inputs must agree on it than on the previous
  /// clock. Therefore a single wrong stamp has no effect, even if it is the first.
  Result<TimePoint> place(const std::string& input, const ros::Time& stamp, std::int64_t now_ns);
  /// Adds a time of the common clock from another source.
  void observeCommon(TimePoint time, std::int64_t now_ns);

 private:
  struct Input {
    bool shared = true;
    LeastDelay delay;
    std::int64_t offset_ns = 0;                 ///< arrival − stamp for the last stamp
    std::optional<std::int64_t> heard_ns = {};  ///< arrival of the last stamp
    /// Offset on which two successive stamps agree, and the time since which stamps agree.
    std::optional<std::int64_t> kept_ns = {};
    std::int64_t kept_since_ns = 0;
    std::optional<TimePoint> last = {};  ///< last time, on the common clock
  };
  Result<std::int64_t> onCommon(const std::string& name, Input& input, std::int64_t stamp_ns,
                                std::int64_t now_ns);
  Result<void> requireCommon(const std::string& name, std::int64_t offset_ns, std::int64_t now_ns);
  void hear(Input& input, std::int64_t offset_ns, std::int64_t now_ns) const;
  bool near(std::int64_t a_ns, std::int64_t b_ns) const;
  /// Returns the shared inputs whose stamps agree on this offset, and of which one arrived in the
  /// last second.
  std::vector<std::string> keepersOf(std::int64_t offset_ns, std::int64_t now_ns) const;
  Reason elsewhere(const std::string& name, std::int64_t offset_ns, std::int64_t now_ns) const;

  std::int64_t apart_ns_;
  std::map<std::string, Input> inputs_;
  std::optional<std::int64_t> common_ns_;  ///< last arrival − stamp on the common clock
  std::string reference_;  ///< input whose delay gives the offset of the common clock
};

}  // namespace perdure::ros2
