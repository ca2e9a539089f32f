// Implements drawResiduals of calibrate.h.

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "tools/calibrate/calibrate.h"
#include "tools/outputs/pictures/chart.h"
#include "tools/outputs/pictures/drawing.h"

namespace perdure::calibrate {
namespace {

using tools::Chart;
using tools::Colour;
using tools::kInk;

constexpr int kImageWidth = 720, kChartWidth = 760, kMargin = 70, kTop = 50;
const Colour kSmall(190, 160, 60), kLarge(40, 60, 220);
const Colour kFirst(200, 120, 30), kSecond(40, 150, 60), kThird(50, 60, 210);

/// Draws residuals as dots that are redder if larger, and the mean of each cell as an arrow.
void drawImage(cv::Mat& picture, const cv::Rect& area, const CameraCalibration& camera,
               const std::vector<CornerResidual>& residuals, double sigma) {
  const double scale = static_cast<double>(area.width) / camera.width;
  cv::rectangle(picture, area, kInk, 1);
  for (const auto& r : residuals) {
    const double share = std::clamp(r.residual.norm() / (3.0 * sigma), 0.0, 1.0);
    const cv::Point at(area.x + static_cast<int>(scale * r.pixel.x()),
                       area.y + static_cast<int>(scale * r.pixel.y()));
    cv::circle(picture, at, 1, tools::mixed(kSmall, kLarge, share), cv::FILLED, cv::LINE_AA);
  }
  const auto cells = cellsOf(camera, residuals);
  constexpr double kEnlarged = 200.0;  // pixels of the picture per pixel of residual
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].corners == 0) continue;
    const auto column = static_cast<double>(i % kCellColumns);
    const auto row = static_cast<double>(i / kCellColumns);
    const cv::Point2d from(area.x + (column + 0.5) * area.width / kCellColumns,
                           area.y + (row + 0.5) * area.height / kCellRows);
    const cv::Point2d to = from + kEnlarged * cv::Point2d(cells[i].mean.x(), cells[i].mean.y());
    cv::arrowedLine(picture, from, to, kInk, 2, cv::LINE_AA, 0, 0.2);
  }
  tools::drawText(picture, "corners, redder the further off; arrows: mean of a cell, 0.1 px as 20",
                  {area.x, area.y - 10}, kInk);
}

using Points = std::vector<cv::Point2d>;

void drawChart(cv::Mat& picture, const cv::Rect& area, const std::string& title,
               const std::vector<std::pair<Points, Colour>>& curves, bool with_x) {
  double low = 0.0, high = 1e-9, from = 0.0, to = 1.0;
  for (const auto& [points, colour] : curves) {
    for (const auto& p : points) {
      low = std::min(low, p.y), high = std::max(high, p.y);
      to = std::max(to, p.x);
    }
  }
  Chart chart(picture, area, {from, to}, {low, high});
  chart.drawGrid(with_x);
  for (const auto& [points, colour] : curves) {
    for (const auto& p : points) {
      cv::circle(picture, chart.at(p.x, p.y), 1, colour, cv::FILLED, cv::LINE_AA);
    }
  }
  tools::drawText(picture, title, {area.x, area.y - 10}, kInk);
}

Points rmsByImage(const std::vector<CornerResidual>& residuals) {
  Points points;
  for (std::size_t i = 0; i < residuals.size();) {
    double sum = 0.0;
    std::size_t n = i;
    for (; n < residuals.size() && residuals[n].frame == residuals[i].frame; ++n) {
      sum += residuals[n].residual.squaredNorm();
    }
    points.emplace_back(residuals[i].time_s, std::sqrt(sum / (2.0 * static_cast<double>(n - i))));
    i = n;
  }
  return points;
}

std::vector<std::pair<Points, Colour>> axesOf(const std::vector<ImuResidual>& all,
                                              Eigen::Vector3d ImuResidual::*which) {
  std::vector<std::pair<Points, Colour>> curves = {{{}, kFirst}, {{}, kSecond}, {{}, kThird}};
  for (const auto& r : all) {
    for (std::size_t i = 0; i < 3; ++i) {
      curves[i].first.emplace_back(r.time_s, (r.*which)[static_cast<Eigen::Index>(i)]);
    }
  }
  return curves;
}

}  // namespace

void drawResiduals(const CalibratedCamera& camera, const std::filesystem::path& file) {
  const auto& residuals = camera.place ? camera.place->residuals : camera.lens.residuals;
  const double sigma = camera.place ? camera.place->sigma_px : camera.lens.sigma_px;
  const CameraCalibration result = camera.result();
  const int height = kImageWidth * static_cast<int>(result.height) / static_cast<int>(result.width);
  const int rows = camera.place ? 3 : 1;
  const int total = std::max(height, rows * 170 + (rows - 1) * 40);
  cv::Mat picture(total + kTop + 60, kImageWidth + kChartWidth + 3 * kMargin, CV_8UC3,
                  tools::kPaper);
  drawImage(picture, {kMargin / 2, kTop, kImageWidth, height}, result, residuals, sigma);
  const int left = kImageWidth + 2 * kMargin, each = (total - (rows - 1) * 40) / rows;
  const auto area = [&](int row) {
    return cv::Rect(left, kTop + row * (each + 40), kChartWidth, each);
  };
  drawChart(picture, area(0), "corners, root mean square of each image, px over s",
            {{rmsByImage(residuals), kThird}}, rows == 1);
  if (camera.place) {
    drawChart(picture, area(1), "gyroscope, what is left of x, y, z, rad/s",
              axesOf(camera.place->imu_residuals, &ImuResidual::gyro), false);
    drawChart(picture, area(2), "accelerometer, what is left of x, y, z, m/s2 over s",
              axesOf(camera.place->imu_residuals, &ImuResidual::accel), true);
  }
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  tools::writePicture(picture, file);
}

}  // namespace perdure::calibrate
