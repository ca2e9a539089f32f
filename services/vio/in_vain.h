// Frames in a row of which nothing comes, and why: what Health says as long as that lasts.
#pragma once

#include <string>

#include "common/camera/camera_model.h"
#include "common/types/sensors.h"

namespace perdure::vio {

class InVain {
 public:
  /// One more frame. why: a sentence with the mend; it is said from the `from`-th frame on.
  void add(std::string why, int from) {
    ++frames_;
    why_ = frames_ >= from ? std::move(why) : std::string();
  }
  /// A frame that was of use.
  void clear() { frames_ = 0, why_.clear(); }
  /// Empty while all is well, or a frame or two are nothing to speak of.
  const std::string& sentence() const { return why_; }

 private:
  int frames_ = 0;
  std::string why_;
};

/// From which frame on Health speaks of it, in general; and of frames of another size, of which one
/// may be left from an earlier setting.
inline constexpr int kInVain = 10;
inline constexpr int kOtherSizes = 2;
inline constexpr char kNoImage[] = "images cannot be read; mend the camera";

/// A sentence with both sizes where the frame has not that of its calibration; else empty.
std::string otherSize(const Frame& frame, const CameraModel& model);

}  // namespace perdure::vio
