// Matches points between two cameras. The second image is warped to the view of the first camera by
// the calibrated rotation, so that only parallax remains. This works for cameras of any size, lens
// and direction.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/replay/recording.h"

namespace perdure::tools {

struct StereoImages {
  cv::Mat first, second;
};

/// Up to `most` pairs of cam0 and cam1, spread over the drive, whose images have the calibrated
/// size.
std::vector<StereoImages> someStereoImages(const replay::Recording& recording,
                                           std::size_t most = 8);

/// Whether the two images of nearly all pairs are the same.
bool areSameImages(const std::vector<StereoImages>& pairs);

struct StereoMatch {
  Eigen::Vector3d first, second;  ///< unit rays in C0 and C1
};

struct StereoMatches {
  std::vector<StereoMatch> matches;
  std::size_t tried = 0;  ///< corners of cam0 that are visible in cam1 if they are far
  double share() const {
    return tried == 0 ? 0.0 : static_cast<double>(matches.size()) / static_cast<double>(tried);
  }
};

/// Mirroring of the second image before the comparison.
enum class Flip { kNone, kSideways, kUpright, kBoth };

/// Tracks corners from the first images to the second; R_C1C0 rotates a ray of C0 into C1.
StereoMatches matchesOf(const std::vector<StereoImages>& pairs, const CameraModel& first,
                        const CameraModel& second, const Eigen::Matrix3d& R_C1C0,
                        Flip flip = Flip::kNone);

}  // namespace perdure::tools
