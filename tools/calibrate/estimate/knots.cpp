// Implements chooseKnotInterval of camera_imu.h: the knot spacing of the trajectory's spline.
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <array>
#include <cmath>

#include "tools/calibrate/estimate/camera_imu.h"

namespace perdure::calibrate {
namespace {

/// Spacings in s, and the largest accepted increase of noise over the smallest spacing.
constexpr std::array kIntervals = {0.2, 0.14, 0.1, 0.07, 0.05, 0.035, 0.025};
constexpr double kMostExcess = 1.02;
constexpr double kLeastSamples = 4.0;  ///< least samples in an interval

using Signals = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// Residual variance per degree of freedom after a fit of a spline of order `Order`.
template <int Order>
double leftOver(const std::vector<double>& times, const Signals& signals, double interval) {
  constexpr auto kWeights = blendingMatrix<Order>();
  const auto segments =
      static_cast<Eigen::Index>(std::floor((times.back() - times.front()) / interval)) + 1;
  const Eigen::Index unknowns = segments + Order - 1;
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double at = (times[i] - times.front()) / interval;
    const auto k = static_cast<Eigen::Index>(at);
    for (int c = 0; c < Order; ++c) {
      const auto w =
          evaluatePolynomial(kWeights[static_cast<std::size_t>(c)], at - static_cast<double>(k));
      entries.emplace_back(static_cast<Eigen::Index>(i), k + c, w[0]);
    }
  }
  Eigen::SparseMatrix<double> A(signals.rows(), unknowns);
  A.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseMatrix<double> N = A.transpose() * A;
  for (Eigen::Index i = 0; i < unknowns; ++i) N.coeffRef(i, i) += 1e-9;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(N);
  const Eigen::MatrixXd x = solver.solve(A.transpose() * signals);
  const double freedom = 3.0 * static_cast<double>(signals.rows() - unknowns);
  return (signals - A * x).squaredNorm() / freedom;
}

}  // namespace

double chooseKnotInterval(const std::vector<ImuReading>& readings) {
  std::vector<double> times;
  Signals gyro(static_cast<Eigen::Index>(readings.size()), 3), accel = gyro;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    times.push_back(readings[i].time_s);
    gyro.row(static_cast<Eigen::Index>(i)) = readings[i].gyro;
    accel.row(static_cast<Eigen::Index>(i)) = readings[i].accel;
  }
  const double usual = (times.back() - times.front()) /
                       static_cast<double>(std::max<std::size_t>(1, times.size() - 1));
  std::vector<double> intervals;
  for (const double interval : kIntervals) {
    if (interval >= kLeastSamples * usual) intervals.push_back(interval);
  }
  if (intervals.empty()) return kLeastSamples * usual;
  // The gyroscope measures the first derivative of an order-5 spline, the accelerometer the second.
  const double gyro_floor = leftOver<kOrder - 1>(times, gyro, intervals.back());
  const double accel_floor = leftOver<kOrder - 2>(times, accel, intervals.back());
  for (const double interval : intervals) {
    if (leftOver<kOrder - 1>(times, gyro, interval) < kMostExcess * gyro_floor &&
        leftOver<kOrder - 2>(times, accel, interval) < kMostExcess * accel_floor) {
      return interval;
    }
  }
  return intervals.back();
}

}  // namespace perdure::calibrate
