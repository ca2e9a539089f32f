#include "tools/calibrate/verdict.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.h"
#include "common/math/so3.h"

namespace perdure::calibrate {
namespace {

constexpr double kDegrees = 180.0 / M_PI;
constexpr std::size_t kEnoughInCell = 15;

std::string placeIn(int column, int row) {
  const char* vertical = row < kCellRows / 3 ? "upper" : row >= 2 * kCellRows / 3 ? "lower" : "";
  const char* horizontal = column < kCellColumns / 3        ? "left"
                           : column >= 2 * kCellColumns / 3 ? "right"
                                                            : "middle";
  return *vertical ? fmt::format("{} {}", vertical, horizontal) : std::string(horizontal);
}

Judgement coverageOf(const std::vector<Cell>& cells) {
  std::size_t seen = 0;
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].corners >= kEnoughInCell) {
      ++seen;
      continue;
    }
    const auto place =
        placeIn(static_cast<int>(i) % kCellColumns, static_cast<int>(i) / kCellColumns);
    if (std::ranges::find(missing, place) == missing.end()) missing.push_back(place);
  }
  const double share = static_cast<double>(seen) / static_cast<double>(cells.size());
  const Grade grade = share >= 0.85 ? Grade::kGood : share >= 0.6 ? Grade::kDoubtful : Grade::kBad;
  return judged(grade, fmt::format("the board was seen in {:.0f} % of the image", 100 * share),
                fmt::format("bring it to the {} as well, as close to the border as it is found",
                            fmt::join(missing, ", ")));
}

/// Judges the number of views in which the board leans by 15° or more about each image axis.
Judgement judgeTilt(const std::vector<RigidTransform>& poses) {
  constexpr double kLean = 15.0 / kDegrees;
  std::array<std::size_t, 2> leaning{};
  for (const auto& T_CT : poses) {
    const Eigen::Vector3d normal = T_CT.q * Eigen::Vector3d::UnitZ();
    leaning[0] += std::abs(std::atan2(normal.x(), normal.z())) > kLean;
    leaning[1] += std::abs(std::atan2(normal.y(), normal.z())) > kLean;
  }
  const std::size_t least = std::min(leaning[0], leaning[1]);
  const Grade grade = least >= 6 ? Grade::kGood : least >= 2 ? Grade::kDoubtful : Grade::kBad;
  return judged(
      grade,
      fmt::format("the board leaned by more than 15° to a side in {} views, up or down in {}",
                  leaning[0], leaning[1]),
      "hold it, or the camera, at 20 to 40 degrees, to both sides and up and down");
}

Judgement judgePattern(const std::vector<Cell>& cells, double sigma_px) {
  double sum = 0.0, expected = 0.0;
  std::size_t count = 0;
  for (const Cell& cell : cells) {
    if (cell.corners < kEnoughInCell) continue;
    sum += cell.mean.squaredNorm();
    expected += 2.0 * sigma_px * sigma_px / static_cast<double>(cell.corners);
    ++count;
  }
  const auto n = static_cast<double>(std::max<std::size_t>(1, count));
  const double pattern = std::sqrt(std::max(0.0, sum - expected) / n);
  return judged(
      gradeOf(pattern, 0.08, 0.25),
      fmt::format("residuals that stay over the image: {:.3f} px", pattern),
      "the lens bends light otherwise than its model (try --lens equidistant, or radtan), "
      "or the board is not flat");
}

Judgement judgeResiduals(double sigma_px) {
  return judged(
      gradeOf(sigma_px, 0.3, 0.8),
      fmt::format("corners are {:.3f} px from where they should be", sigma_px),
      "the images are blurred (more light, shorter exposure, slower motion), or the board "
      "is bent or measured wrongly");
}

Judgement judgeOutliers(std::size_t outliers, std::size_t corners) {
  const double share = static_cast<double>(outliers) /
                       static_cast<double>(std::max<std::size_t>(1, outliers + corners));
  return judged(gradeOf(share, 0.03, 0.2),
                fmt::format("{:.1f} % of the corners were left out", 100 * share),
                "they lie far off: is something in front of the board, or does it shine?");
}

const std::array kAxes = {"x", "y", "z"};  // axes of the body, which is the IMU

void judgeMotion(const CameraImu& place, Judgements& all) {
  for (int i = 0; i < 3; ++i) {
    const double rate = place.rate_rms_B[i], accel = place.accel_rms_B[i];
    const char* axis = kAxes[static_cast<std::size_t>(i)];
    const Grade turned = rate >= 0.25 ? Grade::kGood : rate >= 0.1 ? Grade::kDoubtful : Grade::kBad;
    if (turned != Grade::kGood) {
      all.push_back({turned, fmt::format("the IMU turned about its {} axis by {:.2f} rad/s only; "
                                         "turn it to and fro about that axis, 20 degrees and about "
                                         "once a second",
                                         axis, rate)});
    }
    if (accel < 0.7) {
      all.push_back({accel < 0.2 ? Grade::kBad : Grade::kDoubtful,
                     fmt::format("the IMU was accelerated along its {} axis by {:.2f} m/s² only; "
                                 "shake it to and fro along that axis, by a hand's breadth",
                                 axis, accel)});
    }
  }
  all.push_back({Grade::kGood,
                 fmt::format("motion: {:.2f}, {:.2f}, {:.2f} rad/s and {:.1f}, {:.1f}, "
                             "{:.1f} m/s² (rms)",
                             place.rate_rms_B[0], place.rate_rms_B[1], place.rate_rms_B[2],
                             place.accel_rms_B[0], place.accel_rms_B[1], place.accel_rms_B[2])});
}

/// Judges the estimated standard deviations by the required accuracy: 0.1°, 3 mm, 0.3 ms.
void judgeCertainty(const CameraImu& place, Judgements& all) {
  const auto worst = [&](int at) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(
        place.covariance.block<3, 3>(at, at));
    return std::pair(std::sqrt(eigen.eigenvalues()[2]),
                     Eigen::Vector3d(eigen.eigenvectors().col(2)));
  };
  const auto axisOf = [](const Eigen::Vector3d& direction,
                         const std::array<const char*, 3>& names) {
    Eigen::Index i = 0;
    direction.cwiseAbs().maxCoeff(&i);
    return names[static_cast<std::size_t>(i)];
  };
  const auto [turn, turn_axis] = worst(kRotationAt);
  const auto [shift, shift_axis] = worst(kPositionAt);
  const double offset = std::sqrt(place.covariance(kOffsetAt, kOffsetAt));
  all.push_back(
      judged(gradeOf(kDegrees * turn, 0.1 / 3, 0.1),
             fmt::format("rotation known to {:.4f}°", kDegrees * turn),
             fmt::format("least so about the camera's {} axis: turn it about the others, faster",
                         axisOf(turn_axis, {"x (right)", "y (down)", "z (forward)"}))));
  all.push_back(judged(
      gradeOf(1e3 * shift, 1.0, 3.0), fmt::format("position known to {:.2f} mm", 1e3 * shift),
      fmt::format("least so along the IMU's {} axis: turn faster about the other two, for longer",
                  axisOf(shift_axis, kAxes))));
  all.push_back(judged(gradeOf(1e3 * offset, 0.1, 0.3),
                       fmt::format("time offset known to {:.4f} ms", 1e3 * offset),
                       "turn faster, for longer"));
}

Judgement judgeNoise(const char* name, const char* key, const NoiseCheck& check) {
  const bool coloured = check.correlation > 0.4;
  const Grade grade = coloured ? std::max(Grade::kDoubtful, gradeOf(check.ratio, 1.3, 4.0))
                               : gradeOf(check.ratio, 1.3, 4.0);
  const std::string remedy =
      coloured ? "what is left is no white noise: the body vibrates, the board moved, or samples "
                 "are stamped unevenly"
               : fmt::format("set {} to {:.1f} times what it is, if the IMU was not vibrating", key,
                             check.ratio);
  return judged(grade,
                fmt::format("the {}'s noise is {:.2f} times the declared one", name, check.ratio),
                remedy);
}

}  // namespace

Grade gradeOf(double value, double good, double bad) {
  return value <= good ? Grade::kGood : value <= bad ? Grade::kDoubtful : Grade::kBad;
}

Judgement judged(Grade grade, std::string text, const std::string& remedy) {
  if (grade != Grade::kGood) text += "; " + remedy;
  return {grade, std::move(text)};
}

Grade worstOf(const Judgements& judgements) {
  Grade worst = Grade::kGood;
  for (const auto& j : judgements) worst = std::max(worst, j.grade);
  return worst;
}

const char* wordOf(Grade grade) { return nameAt(std::array{"good", "doubtful", "bad"}, grade); }

std::string summaryOf(const Judgements& judgements) {
  return nameAt(
      std::array{"good: use it", "usable, but record again as the doubtful lines say if you can",
                 "do not use it: correct what the bad lines name and record again"},
      worstOf(judgements));
}

std::vector<Cell> cellsOf(const CameraCalibration& camera,
                          const std::vector<CornerResidual>& residuals) {
  std::vector<Cell> cells(static_cast<std::size_t>(kCellColumns * kCellRows));
  for (const auto& r : residuals) {
    const int column = std::clamp(static_cast<int>(kCellColumns * r.pixel.x() / camera.width), 0,
                                  kCellColumns - 1);
    const int row =
        std::clamp(static_cast<int>(kCellRows * r.pixel.y() / camera.height), 0, kCellRows - 1);
    Cell& cell = cells[static_cast<std::size_t>(row * kCellColumns + column)];
    ++cell.corners;
    cell.mean += r.residual;
  }
  for (Cell& cell : cells) {
    if (cell.corners > 0) cell.mean /= static_cast<double>(cell.corners);
  }
  return cells;
}

Judgement judgeCoverage(const CameraCalibration& camera,
                        const std::vector<CornerResidual>& residuals) {
  return coverageOf(cellsOf(camera, residuals));
}

Judgements judgeLens(const Intrinsics& lens, const CameraViews& seen) {
  Judgements all;
  const auto cells = cellsOf(lens.camera, lens.residuals);
  all.push_back(
      {Grade::kGood, fmt::format("the board was found in {} of {} images; {} views with "
                                 "{} corners were used for the lens",
                                 seen.views.size(), seen.images, lens.views, lens.corners)});
  all.push_back(judgeTilt(lens.T_CT));
  all.push_back(judgeResiduals(lens.sigma_px));
  all.push_back(judgeOutliers(lens.outliers, lens.corners));
  all.push_back(judgePattern(cells, lens.sigma_px));
  const double focal = 100 * std::sqrt(lens.covariance(0, 0)) / lens.camera.fx;
  all.push_back(judged(gradeOf(focal, 0.1, 0.5),
                       fmt::format("focal length known to {:.3f} %", focal),
                       "take more views, closer, and more tilted"));
  const double middle = std::sqrt(std::max(lens.covariance(2, 2), lens.covariance(3, 3)));
  all.push_back(judged(gradeOf(middle, 0.001 * lens.camera.width, 0.005 * lens.camera.width),
                       fmt::format("principal point known to {:.2f} px", middle),
                       "take more tilted views, and some with the camera on its side"));
  return all;
}

Judgements judgePlace(const CameraImu& place, const CameraCalibration& prior) {
  Judgements all;
  all.push_back(
      {Grade::kGood,
       fmt::format("{} images over {:.1f} s with {} inertial samples; knots each {:.0f} ms",
                   place.views, place.to_s - place.from_s, place.samples,
                   1e3 * place.knot_interval_s)});
  judgeMotion(place, all);
  judgeCertainty(place, all);
  all.push_back(judgeResiduals(place.sigma_px));
  all.push_back(judgeOutliers(place.outliers, place.corners));
  all.push_back(judgePattern(cellsOf(place.camera, place.residuals), place.sigma_px));
  all.push_back(judgeNoise("gyroscope", "gyroscope_noise_density", place.gyro));
  all.push_back(judgeNoise("accelerometer", "accelerometer_noise_density", place.accel));
  all.push_back(judged(gradeOf(place.gyro_bias.norm(), 0.1, 0.5),
                       fmt::format("gyroscope bias {:.4f} rad/s", place.gyro_bias.norm()),
                       "that is much: is the IMU's scale right (degrees for radians)?"));
  all.push_back(judged(gradeOf(place.accel_bias.norm(), 0.5, 2.0),
                       fmt::format("accelerometer bias {:.3f} m/s²", place.accel_bias.norm()),
                       "that is much: is --gravity right, and the IMU's scale?"));
  const Eigen::Vector3d turn =
      logSo3(Eigen::Quaterniond(prior.T_BC.q.conjugate() * place.camera.T_BC.q));
  all.push_back(
      {Grade::kGood,
       fmt::format("against the rig before: turned by {:.2f}°, shifted by {:.1f} mm, "
                   "{:.2f} ms later",
                   kDegrees * turn.norm(), 1e3 * (place.camera.T_BC.p - prior.T_BC.p).norm(),
                   1e3 * (place.camera.time_offset_s - prior.time_offset_s))});
  return all;
}

}  // namespace perdure::calibrate
