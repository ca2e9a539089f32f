// What is to be said of a calibration, in words: what is well, what is not, and the mend.
#pragma once

#include <string>
#include <vector>

#include "tools/calibrate/estimate/camera_imu.h"
#include "tools/calibrate/recording.h"

namespace perdure::calibrate {

enum class Grade { kGood, kDoubtful, kBad };

struct Judgement {
  Grade grade = Grade::kGood;
  std::string text;  ///< a sentence; with the mend where it is not good
};
using Judgements = std::vector<Judgement>;

Grade worstOf(const Judgements& judgements);
/// "good", "doubtful", "bad".
const char* wordOf(Grade grade);
/// One sentence for all of it.
std::string summaryOf(const Judgements& judgements);

/// Cells of the image, as in the pictures: residuals are averaged over each.
inline constexpr int kCellColumns = 8, kCellRows = 6;
struct Cell {
  std::size_t corners = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();  ///< residual, px
};
/// Row by row.
std::vector<Cell> cellsOf(const CameraCalibration& camera,
                          const std::vector<CornerResidual>& residuals);

Judgements judgeLens(const Intrinsics& lens, const CameraViews& seen);
/// Which part of the image had the board in it; `residuals` of all views that were used.
Judgement judgeCoverage(const CameraCalibration& camera,
                        const std::vector<CornerResidual>& residuals);
Judgements judgePlace(const CameraImu& place, const CameraCalibration& prior);

}  // namespace perdure::calibrate
