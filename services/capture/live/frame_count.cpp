#include "services/capture/live/frame_count.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace perdure::capture {

std::uint64_t FrameNumbers::of(std::uint32_t sequence) {
  const std::uint32_t gap = last_ ? sequence - *last_ - 1 : 0;
  const bool back = gap > std::numeric_limits<std::uint32_t>::max() / 2;
  lost_ = back ? 0 : gap;
  last_ = sequence;
  next_ += lost_;
  return next_++;
}

bool isEarlier(std::uint32_t a, std::uint32_t b) {
  return b - a - 1 < std::numeric_limits<std::uint32_t>::max() / 2;
}

bool SequenceWatch::skips(std::uint32_t sequence) const {
  return last_ ? sequence != *last_ + 1 : sequence != 0;
}

void RateWatch::reopened() {
  since_ns_.reset();
  known_ = false;
  note_.clear();
}

void RateWatch::frame(std::uint64_t number, std::int64_t time_ns) {
  constexpr double kWindow_s = 5.0, kOff = 0.1;
  if (known_) return;
  if (!since_ns_) {
    since_ns_ = time_ns;
    since_number_ = number;
  }
  const double seconds = 1e-9 * static_cast<double>(time_ns - *since_ns_);
  if (seconds < kWindow_s) return;
  known_ = true;
  const double hz = static_cast<double>(number - since_number_) / seconds;
  if (std::abs(hz / asked_hz_ - 1.0) <= kOff) return;
  note_ = fmt::format(
      "The camera gives {:.0f} images a second where {:g} are asked for, and all of them are given "
      "on; set camera.rate_hz to a rate that it has.",
      hz, asked_hz_);
}

}  // namespace perdure::capture
