// The first row of evolution.png: the body's error in W and on the map, with marks at the loops.
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
    std::optional<double> in_W;    ///< error of the odometry, m
    std::optional<double> then;    ///< error of the map at that time
    std::optional<double> at_end;  ///< error of the final map
  };
  struct Mark {
    std::uint64_t frame = 0;
    EventKind kind = EventKind::kLoopClosed;
  };
  bool against_truth = false;  ///< false: `then` is the correction by the map
  std::vector<Point> points;
  std::vector<Mark> marks;
};

/// Computes the body's errors (m). `poses` (by frame) and ground truth are in W; ground truth is
/// aligned at the start of the run. Returns no points if there was no loop.
BodyErrors bodyErrors(const std::map<std::uint64_t, replay::StampedPose>& poses,
                      const DriveInMap& in_map, std::vector<BodyErrors::Mark> marks,
                      const PictureTruth* truth);

/// Draws the errors into an area of the picture; `frames` is the range of the horizontal axis.
void drawBodyErrors(cv::Mat& picture, const cv::Rect& area, const BodyErrors& errors,
                    const Chart::Range& frames);

}  // namespace perdure::tools
