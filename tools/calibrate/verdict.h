// Judges a calibration in words: a grade of each part, and the fix.
#pragma once

#include <string>
#include <vector>

#include "tools/calibrate/estimate/camera_imu.h"
#include "tools/calibrate/recording.h"

namespace perdure::calibrate {

enum class Grade { kGood, kDoubtful, kBad };

struct Judgement {
  Grade grade = Grade::kGood;
  std::string text;  ///< a sentence; with the fix if the grade is not good
};
using Judgements = std::vector<Judgement>;

/// Returns the grade of a value: good up to `good`, doubtful up to `bad`, else bad.
Grade gradeOf(double value, double good, double bad);
/// Makes a judgement; appends the remedy to the text unless the grade is good.
Judgement judged(Grade grade, std::string text, const std::string& remedy);

Grade worstOf(const Judgements& judgements);
const char* wordOf(Grade grade);
std::string summaryOf(const Judgements& judgements);

/// Cells of the image over which residuals are averaged, as in the pictures.
inline constexpr int kCellColumns = 8, kCellRows = 6;
struct Cell {
  std::size_t corners = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();  ///< mean residual, px
};
std::vector<Cell> cellsOf(const CameraCalibration& camera,
                          const std::vector<CornerResidual>& residuals);

Judgements judgeLens(const Intrinsics& lens, const CameraViews& seen);
/// Judges which part of the image the board covered. `residuals`: those of all used views.
Judgement judgeCoverage(const CameraCalibration& camera,
                        const std::vector<CornerResidual>& residuals);
Judgements judgePlace(const CameraImu& place, const CameraCalibration& prior);

}  // namespace perdure::calibrate
