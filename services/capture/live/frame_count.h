// Numbers and rate of the frames of a live camera.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace perdure::capture {

/// Assigns frame numbers that continue when the camera is reopened. Number and source identify a
/// frame.
class FrameNumbers {
 public:
  /// Call it if the driver's numbers restart with the next frame.
  void reopened() { last_.reset(); }
  /// Returns the number of the frame that has the driver's 32-bit number `sequence`.
  std::uint64_t of(std::uint32_t sequence);
  std::uint64_t lost() const { return lost_; }

 private:
  std::optional<std::uint32_t> last_;
  std::uint64_t next_ = 0, lost_ = 0;
};

/// Returns whether number a is earlier than b, although 32-bit numbers wrap around.
bool isEarlier(std::uint32_t a, std::uint32_t b);

/// Detects missing images before the newest one of the same opening.
class SequenceWatch {
 public:
  bool skips(std::uint32_t sequence) const;
  void seen(std::uint32_t sequence) { last_ = sequence; }

 private:
  std::optional<std::uint32_t> last_;
};

/// Checks, over the first five seconds of each opening, whether a camera delivers the requested
/// rate.
class RateWatch {
 public:
  explicit RateWatch(double asked_hz) : asked_hz_(asked_hz) {}
  void reopened();
  void frame(std::uint64_t number, std::int64_t time_ns);
  /// Returns a sentence if the rate differs by more than a tenth; empty otherwise, and while the
  /// rate is not known.
  const std::string& note() const { return note_; }

 private:
  const double asked_hz_;
  std::optional<std::int64_t> since_ns_;
  std::uint64_t since_number_ = 0;
  bool known_ = false;
  std::string note_;
};

}  // namespace perdure::capture
