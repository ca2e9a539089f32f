#include "services/vio/core/tracks/tracker.h"

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <tuple>

#include "common/base/check.h"
#include "common/math/so3.h"

namespace perdure::vio {
namespace {

constexpr double kBorder = 4.0;
constexpr double kLost = std::numeric_limits<double>::infinity();
constexpr double kStill = 0.5;           // px, largest motion of a point at rest
constexpr std::size_t kFewestStill = 8;  // least number of points at rest
constexpr double kLeastSpreadOfStill =
    0.05;  // least RMS distance of points at rest from their centre, in image widths

Eigen::Vector2d toEigen(const cv::Point2f& p) { return {p.x, p.y}; }
cv::Point2f toCv(const Eigen::Vector2d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y())};
}

cv::TermCriteria criteria(std::int64_t iterations) {
  return {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, static_cast<int>(iterations), 0.01};
}

/// Returns true if `a` has a smaller response than `b`. Equal responses are ordered by row, then
/// column.
bool worse(const cv::KeyPoint& a, const cv::KeyPoint& b) {
  return std::tuple(-a.response, a.pt.y, a.pt.x) > std::tuple(-b.response, b.pt.y, b.pt.x);
}

}  // namespace

Tracker::Tracker(const TrackerOptions& options, const std::vector<CameraModel>& cameras)
    : options_(options), shared_(std::make_shared<const std::vector<CameraModel>>(cameras)) {
  check(!cameras.empty() && cameras.size() <= kMaxCameras, "one or two cameras");
  if (cameras.size() < 2) return;
  const CameraModel &a = cameras[0], &b = cameras[1];
  if (a.width() == b.width() && a.height() == b.height()) return;
  const double scale = a.fx() / b.fx();
  as_first_ = {scale, toCv({a.cx() - scale * b.cx(), a.cy() - scale * b.cy()})};
}

void Tracker::setCameras(std::vector<CameraModel> cameras) {
  shared_ = std::make_shared<const std::vector<CameraModel>>(std::move(cameras));
  std::erase_if(points_, [&](Point& p) {
    const auto seen = imagePoint(camera(0), toEigen(p.pixel));
    if (!seen) return true;
    p.normalised = seen->normalised;
    p.at_middle = atMiddle(*seen);
    return false;
  });
}

void Tracker::reset() {
  points_.clear();
  previous_.clear();
  history_.clear();
}

std::vector<cv::Mat> Tracker::pyramid(const cv::Mat& image, std::int64_t levels) const {
  std::vector<cv::Mat> result;
  const int w = static_cast<int>(options_.window_px);
  cv::buildOpticalFlowPyramid(image, result, {w, w}, static_cast<int>(levels));
  return result;
}

std::vector<cv::Point2f> Tracker::seeds(const std::optional<Eigen::Matrix3d>& R) const {
  std::vector<cv::Point2f> result;
  result.reserve(points_.size());
  const Eigen::Matrix3d R_BC = camera(0).T_BC().R();
  const Eigen::Matrix3d R_C =
      R ? Eigen::Matrix3d(R_BC.transpose() * *R * R_BC) : Eigen::Matrix3d::Identity();
  for (const Point& p : points_) {
    std::optional<Eigen::Vector2d> pixel;
    if (R) pixel = camera(0).project(R_C * p.normalised.homogeneous());
    result.push_back(pixel && camera(0).inImage(*pixel) ? toCv(*pixel) : p.pixel);
  }
  return result;
}

/// Returns the point rotated to the camera's attitude at the middle row. The body's translation
/// between the rows is ignored, because it moves the point along the epipolar line only.
Eigen::Vector2d Tracker::atMiddle(const ImagePoint& seen) const {
  if (turn_.isZero(0.0)) return seen.normalised;
  const Eigen::Vector3d ray = expQuaternion(seen.row * turn_) * seen.normalised.homogeneous();
  return ray.z() > 0.0 ? ray.hnormalized() : seen.normalised;
}

std::vector<bool> Tracker::inliers(const std::vector<Match>& matches,
                                   const std::optional<Eigen::Matrix3d>& R) {
  std::vector<bool> two_point;
  if (R) {
    const Eigen::Matrix3d R_BC = camera(0).T_BC().R();
    two_point = twoPointRansac(matches, R_BC.transpose() * *R * R_BC, options_.ransac_px);
    const auto agreeing = std::count(two_point.begin(), two_point.end(), true);
    if (2 * agreeing > static_cast<long>(matches.size())) return two_point;
    reasons_.add("tracker_rotation_disagrees");
  }
  if (matches.size() < 12) return R ? two_point : std::vector<bool>(matches.size(), true);
  std::vector<cv::Point2f> before, now;
  const double f = camera(0).fx();
  for (const Match& m : matches) {
    before.push_back(toCv(f * m.before));
    now.push_back(toCv(f * m.now));
  }
  cv::Mat mask;
  cv::findFundamentalMat(before, now, cv::FM_RANSAC, options_.ransac_px, 0.99, mask);
  std::vector<bool> result(matches.size(), true);
  if (static_cast<std::size_t>(mask.total()) != matches.size()) return result;
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = mask.at<std::uint8_t>(static_cast<int>(i)) != 0;
  }
  return result;
}

void Tracker::follow(const Images& now, const std::optional<Eigen::Matrix3d>& R) {
  if (points_.empty() || previous_.empty()) return;
  std::vector<cv::Point2f> from, to = seeds(R);
  for (const Point& p : points_) from.push_back(p.pixel);
  std::vector<std::uint8_t> status;
  const int w = static_cast<int>(options_.window_px);
  for (auto* points : {&from, &to}) {
    for (cv::Point2f& p : *points) p *= 0.5F;
  }
  cv::calcOpticalFlowPyrLK(previous_, now.half, from, to, status, cv::noArray(), {w, w},
                           static_cast<int>(options_.pyramid_levels) - 1,
                           criteria(options_.iterations), cv::OPTFLOW_USE_INITIAL_FLOW, 1e-4);
  for (cv::Point2f& p : to) p *= 2.0F;
  std::vector<Point> kept;
  std::vector<Match> matches;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!status[i]) continue;
    Point& p = points_[i];
    const auto found = p.patch->find(now.levels, to[i]);
    if (!found || !(found->similarity >= options_.similarity)) continue;
    const auto seen = imagePoint(camera(0), toEigen(found->pixel));
    if (!seen) continue;
    const Eigen::Vector2d at_middle = atMiddle(*seen);
    matches.push_back({p.at_middle, at_middle, seen->scale});
    p.second += found->pixel - p.pixel;  // start of the search in the second camera
    p.pixel = found->pixel;
    p.normalised = seen->normalised;
    p.at_middle = at_middle;
    if (cv::norm(p.pixel - p.place) <= kStill) {
      ++p.still;
    } else {
      p.place = p.pixel;
      p.still = 0;
    }
    kept.push_back(std::move(p));
  }
  const std::vector<bool> good = inliers(matches, R);
  points_.clear();
  std::vector<Point> renewed;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (!good[i]) continue;
    const bool grown = kept[i].patch->growth() > options_.growth;
    (grown ? renewed : points_).push_back(std::move(kept[i]));
  }
  // Renewed points have new ids and are appended, because points are in order of their ids.
  for (Point& p : renewed) {
    const auto patch = Patch::cut(now.levels.front(), p.pixel);
    if (!patch) continue;
    *p.patch = *patch;
    p.id = next_id_++;
    points_.push_back(std::move(p));
  }
}

void Tracker::detect(const cv::Mat& image, const std::vector<cv::Rect2f>& masked) {
  const auto missing = options_.max_points - static_cast<std::int64_t>(points_.size());
  if (missing <= 0 || 10 * missing < options_.max_points) return;
  const int columns = static_cast<int>(options_.grid_columns);
  const int rows = static_cast<int>(options_.grid_rows);
  const auto per_cell =
      std::max<std::int64_t>(1, (options_.max_points + columns * rows - 1) / (columns * rows));
  std::vector<std::int64_t> filled(static_cast<std::size_t>(columns * rows), 0);
  const double cell_w = image.cols / static_cast<double>(columns);
  const double cell_h = image.rows / static_cast<double>(rows);
  cv::Mat taken = cv::Mat::zeros(image.size(), CV_8UC1);
  const int radius = static_cast<int>(options_.min_distance_px);
  for (const cv::Rect2f& box : masked) cv::rectangle(taken, cv::Rect(box), 255, cv::FILLED);
  for (const Point& p : points_) {
    cv::circle(taken, cv::Point(p.pixel), radius, 255, cv::FILLED);
    const int cell = std::min(static_cast<int>(p.pixel.y / cell_h), rows - 1) * columns +
                     std::min(static_cast<int>(p.pixel.x / cell_w), columns - 1);
    ++filled[static_cast<std::size_t>(cell)];
  }
  std::vector<cv::Point2f> fresh;
  std::vector<cv::KeyPoint> corners;
  for (int cell = 0; cell < columns * rows; ++cell) {
    const std::int64_t wanted = per_cell - filled[static_cast<std::size_t>(cell)];
    // Skips cells that are at least half full, because detection costs more time there than it
    // gains.
    if (2 * wanted <= per_cell) continue;
    // FAST's circle needs a margin of three pixels on each side.
    const cv::Rect inner(static_cast<int>(cell % columns * cell_w),
                         static_cast<int>(cell / columns * cell_h), static_cast<int>(cell_w),
                         static_cast<int>(cell_h));
    const cv::Rect roi =
        (inner + cv::Size(6, 6) - cv::Point(3, 3)) & cv::Rect(0, 0, image.cols, image.rows);
    cv::FAST(image(roi), corners, static_cast<int>(options_.fast_threshold), true);
    if (corners.empty()) cv::FAST(image(roi), corners, 7, true);
    // Takes the strongest corners first; a heap suffices, because only a few are needed.
    std::make_heap(corners.begin(), corners.end(), worse);
    std::int64_t added = 0;
    for (auto end = corners.end(); end != corners.begin(); --end) {
      if (added >= wanted || static_cast<std::int64_t>(fresh.size()) >= missing) break;
      std::pop_heap(corners.begin(), end, worse);
      const cv::KeyPoint& corner = *(end - 1);
      const cv::Point2f p = corner.pt + cv::Point2f(roi.tl());
      if (!camera(0).inImage(toEigen(p), 8.0) || taken.at<std::uint8_t>(cv::Point(p))) continue;
      cv::circle(taken, cv::Point(p), radius, 255, cv::FILLED);
      fresh.push_back(p);
      ++added;
    }
  }
  if (fresh.empty()) return;
  for (const cv::Point2f& p : fresh) {
    const auto seen = imagePoint(camera(0), toEigen(p));
    auto patch = Patch::cut(image, p);
    if (seen && patch) {
      points_.push_back({next_id_++, p, p, false, seen->normalised, atMiddle(*seen),
                         std::make_unique<Patch>(*patch)});
    }
  }
}

cv::Mat Tracker::asFirst(const cv::Mat& second) const {
  if (!as_first_) return second;
  const auto [scale, shift] = *as_first_;
  const auto size =
      cv::Size(static_cast<int>(camera(0).width()), static_cast<int>(camera(0).height()));
  cv::Mat smooth = second, image;
  if (scale < 0.75) cv::GaussianBlur(second, smooth, {}, 0.4 / scale);  // against aliasing
  const cv::Matx23d to(scale, 0, shift.x, 0, scale, shift.y);
  cv::warpAffine(smooth, image, to, size, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return image;
}

void Tracker::followIntoSecond(const std::vector<cv::Mat>& first,
                               const std::vector<cv::Mat>& second) {
  if (points_.empty()) return;
  std::vector<cv::Point2f> from, to, back;
  for (const Point& p : points_) {
    from.push_back(p.pixel);
    to.push_back(!p.has_second ? p.pixel
                 : as_first_   ? as_first_->scale * p.second + as_first_->shift
                               : p.second);
  }
  back = from;
  std::vector<std::uint8_t> status, status_back;
  const int w = static_cast<int>(options_.window_px);
  const auto levels = static_cast<int>(options_.stereo_levels);
  cv::calcOpticalFlowPyrLK(first, second, from, to, status, cv::noArray(), {w, w}, levels,
                           criteria(options_.iterations), cv::OPTFLOW_USE_INITIAL_FLOW, 1e-4);
  cv::calcOpticalFlowPyrLK(second, first, to, back, status_back, cv::noArray(), {w, w}, 1,
                           criteria(options_.iterations), cv::OPTFLOW_USE_INITIAL_FLOW, 1e-4);
  const RigidTransform T_10 = camera(1).T_BC().inverse() * camera(0).T_BC();
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Point& p = points_[i];
    p.has_second = false;
    if (!status[i] || !status_back[i] || cv::norm(back[i] - from[i]) > 1.0) continue;
    if (as_first_) to[i] = (to[i] - as_first_->shift) / as_first_->scale;
    if (!camera(1).inImage(toEigen(to[i]), kBorder)) continue;
    const auto seen = imagePoint(camera(1), toEigen(to[i]));
    if (!seen) continue;
    const Match match{p.normalised, seen->normalised, seen->scale};
    if (epipolarDistance(match, T_10.R(), T_10.p) > options_.stereo_px) continue;
    // If the point is in front of both cameras, its disparity points along the baseline.
    const Eigen::Vector3d turned = T_10.R() * p.normalised.homogeneous();
    const Eigen::Vector3d d = seen->normalised.homogeneous() - turned / turned.z();
    const Eigen::Vector3d along(T_10.p.x() - turned.x() / turned.z() * T_10.p.z(),
                                T_10.p.y() - turned.y() / turned.z() * T_10.p.z(), 0);
    if (d.dot(along) < 0.0 && d.norm() * seen->scale > 1.0) continue;
    p.has_second = true;
    p.second = to[i];
  }
}

TrackedFrame Tracker::result() const {
  TrackedFrame frame;
  frame.cameras = shared_;
  for (const Point& p : points_) {
    TrackedPoint tracked{p.id, {}};
    tracked.seen[0] = imagePoint(camera(0), toEigen(p.pixel));
    if (p.has_second) tracked.seen[1] = imagePoint(camera(1), toEigen(p.second));
    if (tracked.seen[0]) frame.points.push_back(tracked);
  }
  std::sort(frame.points.begin(), frame.points.end(),
            [](const TrackedPoint& a, const TrackedPoint& b) { return a.id < b.id; });
  return frame;
}

TrackedFrame Tracker::track(const cv::Mat& first, const cv::Mat& second,
                            const std::optional<Eigen::Matrix3d>& R_now_before,
                            const std::vector<cv::Rect2f>& masked,
                            const Eigen::Vector3d& turn_of_readout) {
  turn_ = camera(0).T_BC().q.conjugate() * turn_of_readout;
  const bool stereo = shared_->size() == 2 && !second.empty();
  Images now;
  cv::Mat half;
  cv::pyrDown(first, half);
  now.half = pyramid(half, options_.pyramid_levels - 1);
  now.levels.push_back(first);
  for (std::size_t i = 0; i < now.half.size(); i += 2) now.levels.push_back(now.half[i]);
  follow(now, R_now_before);
  std::erase_if(points_, [&](const Point& p) {
    return std::any_of(masked.begin(), masked.end(),
                       [&](const cv::Rect2f& box) { return box.contains(p.pixel); });
  });
  detect(first, masked);
  if (stereo) {
    followIntoSecond(pyramid(first, options_.stereo_levels),
                     pyramid(asFirst(second), options_.stereo_levels));
  } else {
    for (Point& p : points_) p.has_second = false;
  }
  previous_ = std::move(now.half);
  std::vector<std::pair<std::uint64_t, cv::Point2f>> seen;
  for (const Point& p : points_) seen.emplace_back(p.id, p.pixel);
  history_.push_back(std::move(seen));
  while (static_cast<std::int64_t>(history_.size()) > options_.memory + 1) history_.pop_front();
  return result();
}

std::optional<double> Tracker::motionSince(std::size_t frames, double quantile) const {
  constexpr std::size_t kFewest = 10;
  if (frames == 0 || history_.size() <= frames) return std::nullopt;
  const auto& before = history_[history_.size() - 1 - frames];
  std::vector<double> motion;
  auto it = history_.back().begin();
  for (const auto& [id, pixel] : before) {  // both in order of rising id
    while (it != history_.back().end() && it->first < id) ++it;
    const bool seen = it != history_.back().end() && it->first == id;
    motion.push_back(seen ? cv::norm(it->second - pixel) : kLost);
  }
  if (motion.size() < kFewest) return std::nullopt;
  const auto at = static_cast<long>(quantile * static_cast<double>(motion.size()));
  std::nth_element(motion.begin(), motion.begin() + at, motion.end());
  return motion[static_cast<std::size_t>(at)];
}

double Tracker::stillShare(std::size_t frames) const {
  cv::Point2d sum(0, 0);
  double squares = 0.0;
  std::size_t n = 0;
  for (const Point& p : points_) {
    if (p.still < frames) continue;
    const cv::Point2d at = p.pixel;
    sum += at;
    squares += at.dot(at);
    ++n;
  }
  if (n < kFewestStill) return 0.0;
  const auto count = static_cast<double>(n);
  const double spread = std::sqrt(std::max(0.0, squares / count - sum.dot(sum) / (count * count)));
  if (spread < kLeastSpreadOfStill * camera(0).width()) return 0.0;
  return count / static_cast<double>(points_.size());
}

}  // namespace perdure::vio
