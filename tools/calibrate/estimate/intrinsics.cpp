#include "tools/calibrate/estimate/intrinsics.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "common/base/algorithms/median.h"
#include "tools/calibrate/estimate/lens.h"

namespace perdure::calibrate {
namespace {

constexpr std::size_t kLeastCorners = 8, kLeastViews = 5;
constexpr double kOutlierSigma = 5.0, kLeastOutlier = 0.5;  // limits of outliers; the second in px

struct CornerCost {
  DistortionModel model;
  Eigen::Vector3d point_T;
  Eigen::Vector2d pixel;

  template <class T>
  bool operator()(const T* focal, const T* distortion, const T* q_CT, const T* p_CT,
                  T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(q_CT);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> p(p_CT);
    const Eigen::Matrix<T, 3, 1> point = q * point_T.cast<T>() + p;
    if (!(point.z() > T(1e-3))) return false;
    const auto at = projectPoint<T>(model, focal, distortion, point);
    residual[0] = at.x() - T(pixel.x());
    residual[1] = at.y() - T(pixel.y());
    return true;
  }
};

/// The board's four outer corners as shares of the image width, for the comparison of views.
std::optional<Vector8d> outlineOf(const Board& board, const View& view, double width) {
  std::vector<cv::Point2d> plane, image;
  for (const Corner& corner : view.corners) {
    const Eigen::Vector3d p = board.corner(corner.id);
    plane.emplace_back(p.x(), p.y());
    image.emplace_back(corner.pixel.x(), corner.pixel.y());
  }
  const cv::Mat H = cv::findHomography(plane, image, 0);
  if (H.empty()) return std::nullopt;
  const Eigen::Vector2d a = board.printFrom(), b = board.printTo();
  std::vector<cv::Point2d> ends = {{a.x(), a.y()}, {b.x(), a.y()}, {b.x(), b.y()}, {a.x(), b.y()}};
  cv::perspectiveTransform(ends, ends, H);
  Vector8d outline;
  for (int i = 0; i < 4; ++i) {
    const auto& end = ends[static_cast<std::size_t>(i)];
    outline[2 * i] = std::clamp(end.x / width, -1.0, 2.0);
    outline[2 * i + 1] = std::clamp(end.y / width, -1.0, 2.0);
  }
  return outline.allFinite() ? std::optional(outline) : std::nullopt;
}

/// The views that differ most, by farthest-point selection.
std::vector<const View*> mostDifferent(const Board& board, const std::vector<View>& views,
                                       double width, std::size_t most) {
  std::vector<std::pair<const View*, Vector8d>> all;
  for (const View& view : views) {
    if (view.corners.size() < kLeastCorners) continue;
    if (const auto outline = outlineOf(board, view, width)) all.emplace_back(&view, *outline);
  }
  std::vector<const View*> taken;
  std::vector<double> distance(all.size(), std::numeric_limits<double>::max());
  std::size_t next = 0;
  while (taken.size() < std::min(most, all.size())) {
    taken.push_back(all[next].first);
    for (std::size_t i = 0; i < all.size(); ++i) {
      distance[i] = std::min(distance[i], (all[i].second - all[next].second).norm());
    }
    distance[next] = -1.0;
    next = static_cast<std::size_t>(std::ranges::max_element(distance) - distance.begin());
  }
  return taken;
}

/// Mean squared reprojection error of a view for a pose, in px² per corner.
double errorOf(const CameraModel& camera, const Board& board, const View& view,
               const RigidTransform& T_CT) {
  double sum = 0.0;
  for (const Corner& corner : view.corners) {
    const auto pixel = camera.project(T_CT * board.corner(corner.id));
    if (!pixel) return std::numeric_limits<double>::max();
    sum += (*pixel - corner.pixel).squaredNorm();
  }
  return sum / static_cast<double>(view.corners.size());
}

/// A lens without distortion, with the focal length that fits the views best.
CameraCalibration firstGuess(const Board& board, const std::vector<const View*>& views,
                             CameraCalibration camera) {
  constexpr int kSteps = 24;
  const std::size_t used = std::min<std::size_t>(views.size(), 15);
  CameraCalibration best = camera;
  double best_error = std::numeric_limits<double>::max();
  for (int i = 0; i < kSteps; ++i) {
    const double focal = 0.25 * std::pow(12.0, static_cast<double>(i) / (kSteps - 1));
    Vector8d lens = Vector8d::Zero();
    lens << focal * camera.width, focal * camera.width, 0.5 * (camera.width - 1.0),
        0.5 * (camera.height - 1.0), 0, 0, 0, 0;
    setLens(lens, camera);
    const CameraModel model(camera);
    double sum = 0.0;
    for (std::size_t k = 0; k < used; ++k) {
      const auto T_CT = boardPose(model, board, *views[k]);
      // Bounds the error, so that views that do not fit this lens do not dominate the sum.
      const double error = T_CT ? std::sqrt(errorOf(model, board, *views[k], *T_CT)) : 1e9;
      sum += std::min(error, 50.0);
    }
    if (sum < best_error) best_error = sum, best = camera;
  }
  return best;
}

struct ViewState {
  const View* view = nullptr;
  RigidTransform T_CT;
  std::vector<bool> good;
};

class Bundle {
 public:
  Bundle(const Board& board, const CameraCalibration& camera, const IntrinsicsOptions& options)
      : board_(board), camera_(camera), options_(options), lens_(lensOf(camera)) {}

  void take(const std::vector<const View*>& views) {
    const CameraModel model(camera_);
    for (const View* view : views) {
      const auto T_CT = boardPose(model, board_, *view);
      if (!T_CT) continue;
      states_.push_back({view, *T_CT, std::vector<bool>(view->corners.size(), true)});
    }
  }
  std::size_t views() const { return states_.size(); }

  bool solve(bool robust) {
    ceres::Problem problem;
    build(problem, robust);
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::SPARSE_SCHUR;
    solver.max_num_iterations = 100;
    solver.function_tolerance = 1e-10;
    solver.num_threads = 2;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    setLens(lens_, camera_);
    return summary.IsSolutionUsable() && summary.termination_type != ceres::NO_CONVERGENCE;
  }

  /// Removes corners whose residuals are large compared with the median.
  void dropOutliers() {
    std::vector<double> sizes;
    for (const auto& r : residuals()) sizes.push_back(r.residual.norm());
    if (sizes.empty()) return;
    constexpr double kRayleighMedian = 1.1774;  // median length of a 2-D vector with unit variances
    const double limit = std::max(kLeastOutlier, kOutlierSigma * medianOf(sizes) / kRayleighMedian);
    for (ViewState& state : states_) {
      for (std::size_t i = 0; i < state.good.size(); ++i) {
        state.good[i] = residualOf(state, i).norm() < limit;
      }
    }
  }

  std::vector<CornerResidual> residuals() const {
    std::vector<CornerResidual> all;
    for (const ViewState& state : states_) {
      for (std::size_t i = 0; i < state.good.size(); ++i) {
        if (!state.good[i]) continue;
        const Corner& corner = state.view->corners[i];
        all.push_back({state.view->frame, toSeconds(state.view->time - states_[0].view->time),
                       corner.pixel, residualOf(state, i)});
      }
    }
    return all;
  }

  Result<Intrinsics> result() {
    Intrinsics out;
    out.camera = camera_;
    out.residuals = residuals();
    out.views = states_.size(), out.corners = out.residuals.size();
    double sum = 0.0;
    for (const auto& r : out.residuals) sum += r.residual.squaredNorm();
    for (const auto& state : states_) {
      out.T_CT.push_back(state.T_CT);
      out.outliers += static_cast<std::size_t>(std::ranges::count(state.good, false));
    }
    const double unknowns = static_cast<double>(coefficients() + 4 + 6 * states_.size());
    const double freedom = 2.0 * static_cast<double>(out.corners) - unknowns;
    if (freedom < 10)
      return fail("calibrate_few_views",
                  "there are hardly more corners than unknowns; take more views of the board");
    out.sigma_px = std::sqrt(sum / freedom);
    ceres::Problem problem;
    build(problem, false);
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::SPARSE_QR;
    options.num_threads = 2;
    ceres::Covariance covariance(options);
    std::vector<const double*> blocks = {lens_.data()};
    if (coefficients() > 0) blocks.push_back(lens_.data() + 4);
    if (!covariance.Compute(blocks, &problem)) {
      return fail("calibrate_few_views",
                  "the views do not determine the lens; tilt the board against the camera by 20 to "
                  "40 degrees, about both axes, and bring it into the corners of the image");
    }
    const int size = coefficients() > 0 ? 8 : 4;
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> matrix(size, size);
    covariance.GetCovarianceMatrix(blocks, matrix.data());
    out.covariance.topLeftCorner(size, size) = out.sigma_px * out.sigma_px * matrix;
    return out;
  }

 private:
  std::size_t coefficients() const { return options_.model == DistortionModel::kNone ? 0 : 4; }

  void build(ceres::Problem& problem, bool robust) {
    using Cost = ceres::AutoDiffCostFunction<CornerCost, 2, 4, 4, 4, 3>;
    for (ViewState& state : states_) {
      for (std::size_t i = 0; i < state.good.size(); ++i) {
        if (!state.good[i]) continue;
        const Corner& corner = state.view->corners[i];
        auto* cost =
            new Cost(new CornerCost{options_.model, board_.corner(corner.id), corner.pixel});
        problem.AddResidualBlock(cost, robust ? new ceres::HuberLoss(1.0) : nullptr, lens_.data(),
                                 lens_.data() + 4, state.T_CT.q.coeffs().data(),
                                 state.T_CT.p.data());
      }
      if (problem.HasParameterBlock(state.T_CT.q.coeffs().data())) {
        problem.SetManifold(state.T_CT.q.coeffs().data(), new ceres::EigenQuaternionManifold);
      }
    }
    if (coefficients() == 0) problem.SetParameterBlockConstant(lens_.data() + 4);
  }

  Eigen::Vector2d residualOf(const ViewState& state, std::size_t i) const {
    const Corner& corner = state.view->corners[i];
    const Eigen::Vector3d point = state.T_CT * board_.corner(corner.id);
    return corner.pixel -
           projectPoint<double>(options_.model, lens_.data(), lens_.data() + 4, point);
  }

  const Board& board_;
  CameraCalibration camera_;
  IntrinsicsOptions options_;
  Vector8d lens_;
  std::vector<ViewState> states_;
};

}  // namespace

Vector8d lensOf(const CameraCalibration& camera) {
  Vector8d lens = Vector8d::Zero();
  lens.head<4>() << camera.fx, camera.fy, camera.cx, camera.cy;
  for (std::size_t i = 0; i < std::min<std::size_t>(4, camera.distortion_coefficients.size());
       ++i) {
    lens[4 + static_cast<Eigen::Index>(i)] = camera.distortion_coefficients[i];
  }
  return lens;
}

void setLens(const Vector8d& lens, CameraCalibration& camera) {
  camera.fx = lens[0], camera.fy = lens[1], camera.cx = lens[2], camera.cy = lens[3];
  camera.distortion_coefficients.clear();
  if (camera.distortion == DistortionModel::kNone) return;
  camera.distortion_coefficients.assign(lens.data() + 4, lens.data() + 8);
}

std::optional<RigidTransform> boardPose(const CameraModel& camera, const Board& board,
                                        const View& view) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (const Corner& corner : view.corners) {
    const auto n = camera.unproject(corner.pixel);
    if (!n || n->norm() > 20.0) continue;
    const Eigen::Vector3d p = board.corner(corner.id);
    points.emplace_back(p.x(), p.y(), p.z());
    rays.emplace_back(n->x(), n->y());
  }
  if (points.size() < kLeastCorners) return std::nullopt;
  cv::Mat rotation, position;
  const cv::Mat K = cv::Mat::eye(3, 3, CV_64F);
  try {
    if (!cv::solvePnP(points, rays, K, {}, rotation, position, false, cv::SOLVEPNP_IPPE)) {
      return std::nullopt;
    }
    cv::solvePnPRefineLM(points, rays, K, {}, rotation, position);
  } catch (const cv::Exception&) {
    return std::nullopt;  // the corners are collinear
  }
  cv::Mat R;
  cv::Rodrigues(rotation, R);
  Eigen::Matrix3d R_CT;
  Eigen::Vector3d p_CT;
  cv::cv2eigen(R, R_CT);
  cv::cv2eigen(position, p_CT);
  const RigidTransform T_CT(R_CT, p_CT);
  if (!T_CT.finite() || p_CT.z() <= 0.0) return std::nullopt;
  return T_CT;
}

Result<Intrinsics> estimateIntrinsics(const Board& board, const std::vector<View>& views,
                                      const CameraCalibration& camera,
                                      const IntrinsicsOptions& options) {
  const auto chosen = mostDifferent(board, views, camera.width, options.most_views);
  const std::string few = "; take at least 20 pictures of the board from different sides";
  if (chosen.size() < kLeastViews) {
    return fail("calibrate_few_views", "{} views show enough of the board{}", chosen.size(), few);
  }
  CameraCalibration guess = camera;
  guess.distortion = options.model;
  guess = firstGuess(board, chosen, guess);
  // The first solution uses only the views that an undistorted lens explains.
  Bundle rough(board, guess, options);
  rough.take(
      {chosen.begin(),
       chosen.begin() + std::min<std::ptrdiff_t>(15, static_cast<std::ptrdiff_t>(chosen.size()))});
  if (rough.views() < kLeastViews || !rough.solve(true)) {
    return fail("calibrate_no_convergence",
                "no lens explains the views; is --board as it was printed, and is the lens of the "
                "model (--lens radtan or equidistant)?");
  }
  auto first = rough.result();
  if (!first) return first;
  Bundle bundle(board, first->camera, options);
  bundle.take(chosen);
  const char* stuck =
      "least squares did not settle; look at the pictures: is the board flat and sharp in them?";
  if (bundle.views() < kLeastViews || !bundle.solve(true)) {
    return fail("calibrate_no_convergence", stuck);
  }
  bundle.dropOutliers();
  if (!bundle.solve(false)) return fail("calibrate_no_convergence", stuck);
  return bundle.result();
}

}  // namespace perdure::calibrate
