// Counts consecutive frames without a result, and stores the reason for Health.
#pragma once

#include <string>

namespace perdure::vio {

class InVain {
 public:
  /// Adds a frame without a result. why: a sentence, reported from the `from`-th frame on.
  void add(std::string why, int from) {
    ++frames_;
    why_ = frames_ >= from ? std::move(why) : std::string();
  }
  /// Adds a frame with a result.
  void clear() { frames_ = 0, why_.clear(); }
  /// The problem as a sentence; empty if there is no problem, or during the first frames.
  const std::string& sentence() const { return why_; }

 private:
  int frames_ = 0;
  std::string why_;
};

/// Frames after which Health reports the reason; fewer for another size, of which one may remain.
inline constexpr int kInVain = 10;
inline constexpr int kOtherSizes = 2;
inline constexpr char kNoImage[] = "images cannot be read; mend the camera";

}  // namespace perdure::vio
