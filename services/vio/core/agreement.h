// Whether poses (given, or the filter's own) agree with what is seen: over the last images, how
// many tracks with parallax have a place, and how many none that the poses allow.
// Derivation: tools/docs/maths/vio-known-poses.md.
#pragma once

#include <cstddef>

namespace perdure::vio {

/// What became of the tracks of one image.
struct Mapped {
  std::size_t contradicted = 0;  ///< their rays do not meet before the cameras, or fail the gate
  std::size_t far = 0;           ///< they meet beyond VisionOptions::max_depth_m
  std::size_t sure = 0;          ///< landmarks, or what an update has used
};

class Agreement {
 public:
  enum class Verdict { kGood, kContradicted, kFar };

  /// The next image. scale: residuals in those of exact poses, at least 1; moved: the poses have,
  /// lately. Where they have not, what moves is something else.
  void add(const Mapped& mapped, double scale, bool moved);
  /// Of the last two seconds of motion or so, at 20 Hz.
  Verdict verdict() const;
  void clear() { *this = {}; }

 private:
  double contradicted_ = 0.0, far_ = 0.0, sure_ = 0.0, scale_ = 1.0;
  std::size_t images_ = 0;
};

}  // namespace perdure::vio
