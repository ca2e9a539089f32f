// Numbers and rate of the frames of a live camera.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace perdure::capture {

/// Numbers that go on when the camera is opened again: with the source they are a frame's identity.
class FrameNumbers {
 public:
  /// The driver counts anew from the next one on.
  void reopened() { last_.reset(); }
  /// Of the frame that the driver gave this number, in 32 bits.
  std::uint64_t of(std::uint32_t sequence);
  /// Frames that were lost just before that one.
  std::uint64_t lost() const { return lost_; }

 private:
  std::optional<std::uint32_t> last_;
  std::uint64_t next_ = 0, lost_ = 0;
};

/// Of numbers in 32 bits that go round.
bool isEarlier(std::uint32_t a, std::uint32_t b);

/// Whether images of one opening seem to be missing before the one that has come.
class SequenceWatch {
 public:
  bool skips(std::uint32_t sequence) const;
  void seen(std::uint32_t sequence) { last_ = sequence; }

 private:
  std::optional<std::uint32_t> last_;
};

/// Whether a camera gives the rate that it is asked for: over five seconds, once after each
/// opening.
class RateWatch {
 public:
  explicit RateWatch(double asked_hz) : asked_hz_(asked_hz) {}
  void reopened();
  void frame(std::uint64_t number, std::int64_t time_ns);
  /// A sentence where the rate is another one by more than a tenth; empty before it is known.
  const std::string& note() const { return note_; }

 private:
  const double asked_hz_;
  std::optional<std::int64_t> since_ns_;
  std::uint64_t since_number_ = 0;
  bool known_ = false;
  std::string note_;
};

}  // namespace perdure::capture
