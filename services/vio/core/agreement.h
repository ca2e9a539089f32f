// Whether poses agree with the images (tools/docs/maths/vio-known-poses.md).
#pragma once

#include <cstddef>

namespace perdure::vio {

/// Counts of the tracks of one image, by the result of their triangulation.
struct Mapped {
  std::size_t contradicted = 0;  ///< rays that do not meet before the cameras, or fail the gate
  std::size_t far = 0;           ///< points beyond VisionOptions::max_depth_m
  std::size_t sure = 0;          ///< landmarks, and tracks that an update has used
};

class Agreement {
 public:
  enum class Verdict { kGood, kContradicted, kFar };

  /// Adds the next image. scale: residuals relative to those of exact poses, at least 1. moved:
  /// whether the poses have moved recently. If they have not, the image is ignored.
  void add(const Mapped& mapped, double scale, bool moved);
  /// Verdict on about the last two seconds of motion, at 20 Hz.
  Verdict verdict() const;
  void clear() { *this = {}; }

 private:
  double contradicted_ = 0.0, far_ = 0.0, sure_ = 0.0, scale_ = 1.0;
  std::size_t images_ = 0;
};

}  // namespace perdure::vio
