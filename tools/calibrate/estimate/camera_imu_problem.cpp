#include "tools/calibrate/estimate/camera_imu_problem.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>

#include "tools/calibrate/estimate/camera_imu_costs.h"

namespace perdure::calibrate {
namespace {

constexpr double kCluster = 0.25;      // s; residuals within this time may be correlated
constexpr double kBiasInterval = 0.5;  // s
constexpr double kGyroBiasPrior = 0.5, kAccelBiasPrior = 2.0;  // rad/s, m/s²

double* turnOf(Spline& spline, std::size_t i) { return spline.controls[i].q.coeffs().data(); }
double* placeOf(Spline& spline, std::size_t i) { return spline.controls[i].p.data(); }

/// The control points of segment k: five rotations and, if `with_places`, five positions.
std::vector<double*> controlsOf(Spline& spline, std::size_t k, bool with_places) {
  std::vector<double*> blocks;
  for (std::size_t i = 0; i < kOrder; ++i) blocks.push_back(turnOf(spline, k + i));
  for (std::size_t i = 0; with_places && i < kOrder; ++i) blocks.push_back(placeOf(spline, k + i));
  return blocks;
}

/// Factor by which correlated residuals within clusters enlarge the covariance. It is the ratio of
/// the sandwich estimate with clusters to the one with single rows (Liang and Zeger, 1986).
/// `influence`: effect of each row's unit residual on the estimate.
double wideningOf(const Eigen::MatrixXd& influence, const std::vector<double>& residuals,
                  const std::vector<int>& clusters, const Eigen::MatrixXd& covariance) {
  const int last = *std::ranges::max_element(clusters);
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(last + 1, influence.cols());
  Eigen::MatrixXd single = Eigen::MatrixXd::Zero(influence.cols(), influence.cols());
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    const Eigen::RowVectorXd part = residuals[i] * influence.row(static_cast<Eigen::Index>(i));
    sums.row(clusters[i]) += part;
    single += part.transpose() * part;
  }
  const Eigen::LDLT<Eigen::MatrixXd> solver(covariance);
  return solver.solve(sums.transpose() * sums).trace() / solver.solve(single).trace();
}

Eigen::SparseMatrix<double> toEigen(const ceres::CRSMatrix& m) {
  using Rows = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  return Eigen::Map<const Rows>(m.num_rows, m.num_cols, static_cast<Eigen::Index>(m.values.size()),
                                m.rows.data(), m.cols.data(), m.values.data());
}

/// The residuals, and the Jacobian of all free parameters with those of `last` at the end.
Eigen::SparseMatrix<double> jacobianWithLast(ceres::Problem& problem,
                                             const std::vector<double*>& last,
                                             std::vector<double>& residuals) {
  ceres::Problem::EvaluateOptions options;
  options.num_threads = 2;
  std::vector<double*> blocks;
  problem.GetParameterBlocks(&blocks);
  for (double* block : blocks) {
    const bool is_last = std::ranges::find(last, block) != last.end();
    if (is_last || problem.IsParameterBlockConstant(block)) continue;
    options.parameter_blocks.push_back(block);
  }
  options.parameter_blocks.insert(options.parameter_blocks.end(), last.begin(), last.end());
  ceres::CRSMatrix crs;
  problem.Evaluate(options, nullptr, &residuals, nullptr, &crs);
  return toEigen(crs);
}

}  // namespace

CameraImuProblem::CameraImuProblem(const Board& board, DistortionModel model, double readout_s,
                                   double height, const CameraImuOptions& options)
    : board_(board), model_(model), readout_s_(readout_s), height_(height), options_(options) {}

void CameraImuProblem::setBiases(const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel) {
  const double length = x.spline.end_s() - x.spline.start_s;
  const auto count = static_cast<std::size_t>(std::ceil(length / kBiasInterval)) + 1;
  x.gyro_bias.assign(count, gyro);
  x.accel_bias.assign(count, accel);
}

std::size_t CameraImuProblem::biasAt(double t, double& share) const {
  const double at = (t - x.spline.start_s) / kBiasInterval;
  const auto i = std::min(static_cast<std::size_t>(std::max(0.0, at)), x.gyro_bias.size() - 2);
  share = at - static_cast<double>(i);
  return i;
}

double CameraImuProblem::delayOf(const Corner& corner) const {
  return readout_s_ * (corner.pixel.y() / (height_ - 1.0) - 0.5);
}

void CameraImuProblem::addFrames(ceres::Problem& problem) {
  using Cost = ceres::AutoDiffCostFunction<FrameCost, ceres::DYNAMIC, 4, 4, 4, 4, 4, 3, 3, 3, 3, 3,
                                           4, 3, 1, 4, 4>;
  for (const Sighting& sighting : sightings) {
    const std::size_t k = x.spline.segmentAt(sighting.time_s + x.time_offset_s);
    FrameCost cost{model_,
                   x.spline.withinOf(k, sighting.time_s),
                   x.spline.interval_s,
                   1 / sigma.px,
                   readout_s_ > 0.0,
                   {}};
    for (std::size_t i = 0; i < sighting.good.size(); ++i) {
      const Corner& corner = sighting.view.corners[i];
      if (!sighting.good[i]) continue;
      cost.sights.push_back({board_.corner(corner.id), corner.pixel, delayOf(corner)});
    }
    if (cost.sights.empty()) continue;
    const int rows = 2 * static_cast<int>(cost.sights.size());
    auto blocks = controlsOf(x.spline, k, true);
    blocks.insert(blocks.end(), {x.q_BC.coeffs().data(), x.p_BC.data(), &x.time_offset_s,
                                 x.lens.data(), x.lens.data() + 4});
    problem.AddResidualBlock(new Cost(new FrameCost(std::move(cost)), rows), nullptr, blocks);
  }
}

void CameraImuProblem::addSamples(ceres::Problem& problem) {
  using Gyro = ceres::AutoDiffCostFunction<GyroCost, 3, 4, 4, 4, 4, 4, 3, 3>;
  using Accel = ceres::AutoDiffCostFunction<AccelCost, 3, 4, 4, 4, 4, 4, 3, 3, 3, 3, 3, 3, 3, 3>;
  for (const ImuReading& reading : readings) {
    const std::size_t k = x.spline.segmentAt(reading.time_s);
    const double u = x.spline.withinOf(k, reading.time_s), dt = x.spline.interval_s;
    double share = 0.0;
    const std::size_t b = biasAt(reading.time_s, share);
    auto turns = controlsOf(x.spline, k, false);
    turns.insert(turns.end(), {x.gyro_bias[b].data(), x.gyro_bias[b + 1].data()});
    problem.AddResidualBlock(new Gyro(new GyroCost{u, dt, share, 1 / sigma.gyro, reading.gyro}),
                             nullptr, turns);
    auto all = controlsOf(x.spline, k, true);
    all.insert(all.end(), {x.accel_bias[b].data(), x.accel_bias[b + 1].data(), x.down_T.data()});
    problem.AddResidualBlock(
        new Accel(new AccelCost{u, dt, share, 1 / sigma.accel, options_.gravity, reading.accel}),
        nullptr, all);
  }
}

void CameraImuProblem::addBiases(ceres::Problem& problem) {
  using Walk = ceres::AutoDiffCostFunction<WalkCost, 3, 3, 3>;
  using Prior = ceres::AutoDiffCostFunction<BiasPrior, 3, 3>;
  const auto add = [&](std::vector<Eigen::Vector3d>& bias, double walk, double prior) {
    const double weight = 1.0 / (std::max(walk, 1e-7) * std::sqrt(kBiasInterval));
    for (std::size_t i = 0; i + 1 < bias.size(); ++i) {
      problem.AddResidualBlock(new Walk(new WalkCost{weight}), nullptr, bias[i].data(),
                               bias[i + 1].data());
    }
    problem.AddResidualBlock(new Prior(new BiasPrior{1.0 / prior}), nullptr, bias[0].data());
  };
  add(x.gyro_bias, sigma.gyro_walk, kGyroBiasPrior);
  add(x.accel_bias, sigma.accel_walk, kAccelBiasPrior);
}

void CameraImuProblem::build(ceres::Problem& problem) {
  addFrames(problem);
  addSamples(problem);
  addBiases(problem);
  for (std::size_t i = 0; i < x.spline.controls.size(); ++i) {
    problem.AddParameterBlock(turnOf(x.spline, i), 4, new RightRotation);
    problem.AddParameterBlock(placeOf(x.spline, i), 3);
  }
  problem.AddParameterBlock(x.q_BC.coeffs().data(), 4, new RightRotation);
  problem.SetManifold(x.down_T.data(), new ceres::SphereManifold<3>);
  if (options_.hold_lens) problem.SetParameterBlockConstant(x.lens.data());
  if (options_.hold_lens || !hasDistortion()) problem.SetParameterBlockConstant(x.lens.data() + 4);
}

bool CameraImuProblem::solve(int iterations) {
  ceres::Problem problem;
  build(problem);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = iterations;
  options.function_tolerance = 1e-7;
  options.num_threads = 2;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.IsSolutionUsable() && std::isfinite(summary.final_cost);
}

Eigen::Vector2d CameraImuProblem::residualOf(const Sighting& sighting, std::size_t i) const {
  const Corner& corner = sighting.view.corners[i];
  const double t = sighting.time_s + x.time_offset_s + delayOf(corner);
  const RigidTransform T_TC = x.spline.poseAt(t) * RigidTransform(x.q_BC, x.p_BC);
  const Eigen::Vector3d point = T_TC.inverse() * board_.corner(corner.id);
  if (point.z() < 1e-3) return Eigen::Vector2d::Constant(1e6);
  return corner.pixel - projectPoint<double>(model_, x.lens.data(), x.lens.data() + 4, point);
}

std::vector<CornerResidual> CameraImuProblem::cornerResiduals() const {
  std::vector<CornerResidual> all;
  for (const Sighting& sighting : sightings) {
    for (std::size_t i = 0; i < sighting.good.size(); ++i) {
      if (!sighting.good[i]) continue;
      all.push_back({sighting.view.frame, sighting.time_s, sighting.view.corners[i].pixel,
                     residualOf(sighting, i)});
    }
  }
  return all;
}

void CameraImuProblem::gateCorners(double limit_px) {
  for (Sighting& sighting : sightings) {
    for (std::size_t i = 0; i < sighting.good.size(); ++i) {
      sighting.good[i] = residualOf(sighting, i).norm() < limit_px;
    }
  }
}

std::vector<ImuResidual> CameraImuProblem::imuResiduals() const {
  std::vector<ImuResidual> all;
  Spline spline = x.spline;  // Ceres needs non-const pointers
  for (const ImuReading& reading : readings) {
    const std::size_t k = x.spline.segmentAt(reading.time_s);
    const double u = x.spline.withinOf(k, reading.time_s), dt = x.spline.interval_s;
    double share = 0.0;
    const std::size_t b = biasAt(reading.time_s, share);
    const auto c = controlsOf(spline, k, true);
    ImuResidual r{reading.time_s, {}, {}};
    GyroCost{u, dt, share, 1.0, reading.gyro}(c[0], c[1], c[2], c[3], c[4], x.gyro_bias[b].data(),
                                              x.gyro_bias[b + 1].data(), r.gyro.data());
    AccelCost{u, dt, share, 1.0, options_.gravity, reading.accel}(
        c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], x.accel_bias[b].data(),
        x.accel_bias[b + 1].data(), x.down_T.data(), r.accel.data());
    all.push_back(r);
  }
  return all;
}

Eigen::Vector3d CameraImuProblem::biasMean(const std::vector<Eigen::Vector3d>& bias) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& b : bias) sum += b;
  return sum / static_cast<double>(bias.size());
}

/// The cluster (an interval of kCluster) of each row of the Jacobian, in the order of build().
std::vector<int> CameraImuProblem::clusterOfRows() const {
  std::vector<int> clusters;
  const auto add = [&](double t, std::size_t rows) {
    const int cluster = static_cast<int>(std::max(0.0, t - x.spline.start_s) / kCluster);
    clusters.insert(clusters.end(), rows, cluster);
  };
  for (const Sighting& sighting : sightings) {
    const auto good = std::ranges::count(sighting.good, true);
    add(sighting.time_s + x.time_offset_s, 2 * static_cast<std::size_t>(good));
  }
  for (const ImuReading& reading : readings) add(reading.time_s, 6);
  return clusters;
}

std::vector<double*> CameraImuProblem::calibrationBlocks() {
  std::vector<double*> blocks = {x.q_BC.coeffs().data(), x.p_BC.data(), &x.time_offset_s};
  if (!options_.hold_lens) blocks.push_back(x.lens.data());
  if (!options_.hold_lens && hasDistortion()) blocks.push_back(x.lens.data() + 4);
  return blocks;
}

// Factorises the normal equations once and computes only the required columns of the inverse.
Result<CameraImuProblem::Certainty> CameraImuProblem::certainty() {
  const auto blind =
      fail("calibrate_not_observable",
           "the recording does not tell where the camera sits on the IMU; turn it to "
           "and fro about all three axes, and shake it, while the board is in view");
  ceres::Problem problem;
  build(problem);
  std::vector<double*> wanted = calibrationBlocks();
  constexpr Eigen::Index kSizes[] = {3, 6, 7, 11, 15};  // sizes of the first 1, 2, … blocks
  const Eigen::Index calibrated = kSizes[wanted.size() - 1], size = calibrated + 6;
  const std::size_t middle = x.gyro_bias.size() / 2;
  wanted.insert(wanted.end(), {x.gyro_bias[middle].data(), x.accel_bias[middle].data()});
  std::vector<double> residuals;
  const Eigen::SparseMatrix<double> J = jacobianWithLast(problem, wanted, residuals);
  const Eigen::SparseMatrix<double> information = J.transpose() * J;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(information);
  if (solver.info() != Eigen::Success || solver.vectorD().minCoeff() <= 0.0) return blind;
  Eigen::MatrixXd units = Eigen::MatrixXd::Zero(information.cols(), size);
  units.bottomRows(size).setIdentity();
  const Eigen::MatrixXd columns = solver.solve(units);
  const Eigen::MatrixXd covariance = columns.bottomRows(size);
  if (!covariance.allFinite() || covariance.diagonal().minCoeff() <= 0.0) return blind;
  Certainty out;
  const Eigen::MatrixXd own = covariance.topLeftCorner(calibrated, calibrated);
  out.widened =
      std::max(1.0, wideningOf(J * columns.leftCols(calibrated), residuals, clusterOfRows(), own));
  out.calibration.topLeftCorner(calibrated, calibrated) = out.widened * own;
  const Eigen::VectorXd deviations = (out.widened * covariance.diagonal()).cwiseSqrt();
  out.gyro_bias = deviations.segment<3>(calibrated);
  out.accel_bias = deviations.tail<3>();
  return out;
}

}  // namespace perdure::calibrate
