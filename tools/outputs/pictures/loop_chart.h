// The first row of evolution.png: how far off the body was in W, and on the map before and after
// each loop.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "common/replay/files/pose_file.h"
#include "common/types/objects.h"
#include "tools/outputs/frames/drive_in_map.h"
#include "tools/outputs/pictures/chart.h"
#include "tools/outputs/pictures/picture_truth.h"

namespace perdure::tools {

struct BodyErrors {
  struct Point {
    std::uint64_t frame = 0;
    std::optional<double> in_W;    ///< of the odometry, m
    std::optional<double> then;    ///< where the map had the body at that time
    std::optional<double> at_end;  ///< where the map has that place in the end
  };
  struct Mark {
    std::uint64_t frame = 0;
    EventKind kind = EventKind::kLoopClosed;
  };
  bool against_truth = false;  ///< else `then` is how far the map moved the body out of W
  std::vector<Point> points;
  std::vector<Mark> marks;
};

/// `poses` in W, by frame. Truth is in W, laid where the run begins; so are all of the errors. No
/// points where there was no loop.
BodyErrors bodyErrors(const std::map<std::uint64_t, replay::StampedPose>& poses,
                      const DriveInMap& in_map, std::vector<BodyErrors::Mark> marks,
                      const PictureTruth* truth);

/// Into an area of the picture; `frames` is the range of the axis below.
void drawBodyErrors(cv::Mat& picture, const cv::Rect& area, const BodyErrors& errors,
                    const Chart::Range& frames);

}  // namespace perdure::tools
