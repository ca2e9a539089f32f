// What two cameras see of the same points. The second image is looked at as the first camera would
// see it from there, turned by what the calibration says: so cameras of any size, lens and
// direction can be compared, and what remains is parallax.
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

/// Up to `most` pairs of cam0 and cam1, over the drive, of those whose images have the
/// calibration's size.
std::vector<StereoImages> someStereoImages(const replay::Recording& recording,
                                           std::size_t most = 8);

/// Whether nearly all pairs show the same picture twice.
bool areSameImages(const std::vector<StereoImages>& pairs);

struct StereoMatch {
  Eigen::Vector3d first, second;  ///< unit rays in C0 and C1
};

struct StereoMatches {
  std::vector<StereoMatch> matches;
  std::size_t tried = 0;  ///< corners of cam0 that cam1 would see, were they far
  double share() const {
    return tried == 0 ? 0.0 : static_cast<double>(matches.size()) / static_cast<double>(tried);
  }
};

/// How the second image is mirrored before it is looked at.
enum class Flip { kNone, kSideways, kUpright, kBoth };

/// R: the direction of C0's rays in C1.
StereoMatches matchesOf(const std::vector<StereoImages>& pairs, const CameraModel& first,
                        const CameraModel& second, const Eigen::Matrix3d& R_C1C0,
                        Flip flip = Flip::kNone);

}  // namespace perdure::tools
