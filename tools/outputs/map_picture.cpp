#include "tools/outputs/map_picture.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/math/so3.h"

namespace perdure::tools {
namespace {

constexpr int kMargin = 60;
constexpr double kLongSide = 1400.0;  // pixels
const cv::Scalar kInk(60, 50, 40), kPath(200, 120, 20), kStatic(60, 140, 30), kMoving(40, 90, 230);

// Metres of W to pixels.
class Canvas {
 public:
  Canvas(const Eigen::Vector2d& low, const Eigen::Vector2d& high)
      : low_(low), scale_(kLongSide / (high - low).maxCoeff()) {
    const Eigen::Vector2d size = scale_ * (high - low);
    image_ = cv::Mat(static_cast<int>(size.y()) + 2 * kMargin,
                     static_cast<int>(size.x()) + 2 * kMargin, CV_8UC3, cv::Scalar(252, 250, 248));
  }
  cv::Point2d at(const Eigen::Vector2d& p) const {
    return {kMargin + scale_ * (p.x() - low_.x()),
            image_.rows - kMargin - scale_ * (p.y() - low_.y())};
  }
  double scale() const { return scale_; }
  cv::Mat& image() { return image_; }

 private:
  Eigen::Vector2d low_;
  double scale_;
  cv::Mat image_;
};

void drawFootprint(Canvas& canvas, const ClassBelief& belief, const cv::Scalar& colour) {
  const Eigen::Vector3d half = 0.5 * belief.mean.tail<3>().array().exp();
  const Eigen::Matrix2d R = rotationAboutZ(belief.mean[3]).topLeftCorner<2, 2>();
  std::vector<cv::Point> corners;
  for (const auto& [sx, sy] : {std::pair{1, 1}, {1, -1}, {-1, -1}, {-1, 1}}) {
    corners.emplace_back(
        canvas.at(belief.mean.head<2>() + R * Eigen::Vector2d(sx * half.x(), sy * half.y())));
  }
  cv::polylines(canvas.image(), corners, true, colour, 2, cv::LINE_AA);
  cv::line(canvas.image(), canvas.at(belief.mean.head<2>()),
           canvas.at(belief.mean.head<2>() + R * Eigen::Vector2d(half.x(), 0)), colour, 2,
           cv::LINE_AA);
}

void drawUncertainty(Canvas& canvas, const ClassBelief& belief, const cv::Scalar& colour) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(
      Eigen::Matrix2d(belief.covariance.topLeftCorner<2, 2>()));
  const Eigen::Vector2d axes = 2.0 * canvas.scale() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  if (!axes.allFinite() || axes.maxCoeff() > 4.0 * kLongSide) return;
  const Eigen::Vector2d major = eigen.eigenvectors().col(1);
  const double degrees = -std::atan2(major.y(), major.x()) * 180.0 / std::numbers::pi;
  cv::ellipse(
      canvas.image(), canvas.at(belief.mean.head<2>()),
      cv::Size(std::max(1, static_cast<int>(axes[1])), std::max(1, static_cast<int>(axes[0]))),
      degrees, 0, 360, colour, 1, cv::LINE_AA);
}

void drawScaleBar(Canvas& canvas) {
  const double metres = std::pow(10.0, std::floor(std::log10(0.3 * kLongSide / canvas.scale())));
  const cv::Point2d from(kMargin, canvas.image().rows - 24);
  const cv::Point2d to(from.x + metres * canvas.scale(), from.y);
  cv::line(canvas.image(), from, to, kInk, 3, cv::LINE_AA);
  cv::putText(canvas.image(), fmt::format("{:g} m", metres), to + cv::Point2d(10, 5),
              cv::FONT_HERSHEY_SIMPLEX, 0.5, kInk, 1, cv::LINE_AA);
}

}  // namespace

bool drawMap(const std::vector<Eigen::Vector3d>& path, const std::vector<ObjectBelief>& objects,
             const std::filesystem::path& file) {
  if (path.empty() && objects.empty()) return false;
  Eigen::AlignedBox2d bounds;
  for (const auto& p : path) bounds.extend(p.head<2>());
  for (const auto& o : objects) bounds.extend(o.best().mean.head<2>());
  const Eigen::Vector2d room = Eigen::Vector2d::Constant(4.0);
  Canvas canvas(bounds.min() - room, bounds.max() + room);
  for (std::size_t i = 1; i < path.size(); ++i) {
    cv::line(canvas.image(), canvas.at(path[i - 1].head<2>()), canvas.at(path[i].head<2>()), kPath,
             2, cv::LINE_AA);
  }
  for (const ObjectBelief& object : objects) {
    const cv::Scalar& colour = object.moving >= 0.5 ? kMoving : kStatic;
    drawFootprint(canvas, object.best(), colour);
    drawUncertainty(canvas, object.best(), colour);
    cv::putText(canvas.image(), fmt::format("{} {}", object.id, object.best().name),
                canvas.at(object.best().mean.head<2>()) + cv::Point2d(8, -8),
                cv::FONT_HERSHEY_SIMPLEX, 0.45, kInk, 1, cv::LINE_AA);
  }
  drawScaleBar(canvas);
  return cv::imwrite(file.string(), canvas.image());
}

}  // namespace perdure::tools
