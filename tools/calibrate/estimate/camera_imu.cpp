#include "tools/calibrate/estimate/camera_imu.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/algorithms/median.h"
#include "common/math/so3.h"
#include "tools/calibrate/estimate/camera_imu_problem.h"

namespace perdure::calibrate {
namespace {

constexpr std::size_t kLeastSightings = 60;
constexpr int kRounds = 4;  ///< rounds of solving, weighting and outlier removal
constexpr double kGateSigma = 5.0;
constexpr double kLeastPx = 0.02;
constexpr double kSettled = 1e-5;  ///< s, change of the time offset below which the rounds end

Eigen::Vector3d rmsOf(const std::vector<ImuResidual>& all, Eigen::Vector3d ImuResidual::*which) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& r : all) sum += (r.*which).cwiseAbs2();
  return (sum / static_cast<double>(all.size())).cwiseSqrt();
}

double correlationOf(const std::vector<ImuResidual>& all, Eigen::Vector3d ImuResidual::*which) {
  double product = 0.0, square = 0.0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    product += (all[i - 1].*which).dot(all[i].*which);
    square += (all[i].*which).squaredNorm();
  }
  return square > 0.0 ? product / square : 0.0;
}

/// Whether the readings are clipped: the largest value of an axis occurs three times in a row.
bool isSaturated(const std::vector<ImuReading>& readings, Eigen::Vector3d ImuReading::*which,
                 double least) {
  for (int axis = 0; axis < 3; ++axis) {
    double largest = 0.0;
    for (const auto& r : readings) largest = std::max(largest, std::abs((r.*which)[axis]));
    int in_a_row = 0, longest = 0;
    for (const auto& r : readings) {
      in_a_row = std::abs((r.*which)[axis]) == largest ? in_a_row + 1 : 0;
      longest = std::max(longest, in_a_row);
    }
    if (largest > least && longest >= 3) return true;
  }
  return false;
}

std::vector<Sighting> longestStretch(const std::vector<Sighting>& all, double gap_s) {
  std::size_t best_from = 0, best_to = 0, from = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i > 0 && all[i].time_s - all[i - 1].time_s > gap_s) from = i;
    if (all[i].time_s - all[from].time_s > all[best_to].time_s - all[best_from].time_s) {
      best_from = from, best_to = i;
    }
  }
  const auto at = [&](std::size_t i) { return all.begin() + static_cast<std::ptrdiff_t>(i); };
  return all.empty() ? all : std::vector<Sighting>(at(best_from), at(best_to + 1));
}

class CameraImuRun {
 public:
  CameraImuRun(const CameraImuInput& input, const CameraImuOptions& options)
      : input_(input),
        options_(options),
        problem_(input.board, input.camera.distortion, input.camera.readout_s, input.camera.height,
                 options) {}

  Result<CameraImu> run() {
    if (auto ready = prepare(); !ready) return tl::unexpected(ready.error());
    if (auto started = start(); !started) return tl::unexpected(started.error());
    if (auto solved = solve(); !solved) return tl::unexpected(solved.error());
    return report();
  }

 private:
  /// Computes the camera poses and their time interval, and selects the IMU readings in it.
  Result<void> prepare() {
    if (input_.views.empty()) {
      return fail("calibrate_few_views", "no image shows the board; see --board");
    }
    if (input_.samples.size() < 100) {
      return fail("calibrate_imu_missing",
                  "there are no inertial samples; record imu along with the images, or calibrate "
                  "the lens alone (--intrinsics-only)");
    }
    const CameraModel camera(input_.camera);
    const TimePoint epoch = input_.views[0].time;
    std::vector<Sighting> all;
    for (const View& view : input_.views) {
      const auto T_CT = boardPose(camera, input_.board, view);
      if (!T_CT) continue;
      const double t = toSeconds(view.time - epoch);
      all.push_back({view, t, std::vector<bool>(view.corners.size(), true)});
      poses_.push_back({t, T_CT->inverse()});
    }
    problem_.sightings = longestStretch(all, options_.longest_gap_s);
    if (problem_.sightings.size() < kLeastSightings) {
      return fail("calibrate_few_views",
                  fmt::format("the board is in view without a break in only {} images; at least {} "
                              "in a row are needed, and 20 s or more are good",
                              problem_.sightings.size(), kLeastSightings));
    }
    const double from = problem_.sightings.front().time_s, to = problem_.sightings.back().time_s;
    std::erase_if(poses_, [&](const auto& p) { return p.time_s < from || p.time_s > to; });
    const double reach = options_.widest_offset_s + 1.0;
    for (const ImuSample& sample : input_.samples) {
      const double t = toSeconds(sample.time - epoch);
      if (t > from - reach && t < to + reach) near_.push_back({t, sample.gyro, sample.accel});
    }
    return checkReadings(from, to);
  }

  Result<void> checkReadings(double from, double to) const {
    double longest = 0.0;
    for (std::size_t i = 1; i < near_.size(); ++i) {
      longest = std::max(longest, near_[i].time_s - near_[i - 1].time_s);
    }
    if (near_.size() < 100 || near_.front().time_s > from + 1.0 || near_.back().time_s < to - 1.0) {
      return fail("calibrate_imu_missing",
                  "inertial samples do not cover the time of the images; are both stamped by one "
                  "clock, and was the IMU running from beginning to end?");
    }
    if (longest > 0.1) {
      return fail("calibrate_imu_missing",
                  fmt::format("inertial samples are missing for {:.2f} s; record again with less "
                              "load on the machine",
                              longest));
    }
    if (isSaturated(near_, &ImuReading::gyro, 1.0) ||
        isSaturated(near_, &ImuReading::accel, 12.0)) {
      return fail("calibrate_imu_saturated",
                  "the IMU reached the end of its range; move less violently, or set a wider range "
                  "of the IMU");
    }
    return {};
  }

  Result<void> start() {
    const auto aligned = alignRates(poses_, near_, options_.widest_offset_s);
    if (!aligned) return tl::unexpected(aligned.error());
    dropDisagreeing(*aligned);
    auto& x = problem_.x;
    x.q_BC = aligned->q_BC, x.p_BC = input_.camera.T_BC.p;
    x.time_offset_s = aligned->time_offset_s;
    x.lens = lensOf(input_.camera);
    problem_.sigma.px = input_.sigma_px;
    const double rate =
        static_cast<double>(near_.size() - 1) / (near_.back().time_s - near_.front().time_s);
    problem_.sigma.gyro = std::max(1e-5, input_.imu.gyro_noise * std::sqrt(rate));
    problem_.sigma.accel = std::max(1e-4, input_.imu.accel_noise * std::sqrt(rate));
    problem_.sigma.gyro_walk = input_.imu.gyro_bias_walk;
    problem_.sigma.accel_walk = input_.imu.accel_bias_walk;
    declared_ = problem_.sigma;
    placeSpline();
    problem_.setBiases(aligned->gyro_bias, Eigen::Vector3d::Zero());
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (const ImuReading& r : problem_.readings) {
      force += x.spline.poseAt(r.time_s).q * r.accel;
    }
    x.down_T = -force.normalized();
    return {};
  }

  /// Removes views whose rotation contradicts the gyroscope.
  void dropDisagreeing(const Alignment& alignment) {
    const auto good = agreeing(poses_, near_, alignment);
    std::vector<CameraPose> poses;
    std::vector<Sighting> sightings;
    for (std::size_t i = 0; i < good.size(); ++i) {
      if (!good[i]) continue;
      poses.push_back(poses_[i]);
      sightings.push_back(std::move(problem_.sightings[i]));
    }
    poses_ = std::move(poses), problem_.sightings = std::move(sightings);
  }

  void placeSpline() {
    auto& x = problem_.x;
    x.spline.interval_s = chooseKnotInterval(near_);
    // Time in s by which the spline extends beyond the views, so that the time offset can change.
    constexpr double kPad = 0.05;
    const double from =
        std::max(near_.front().time_s, problem_.sightings.front().time_s + x.time_offset_s - kPad);
    const double to =
        std::min(near_.back().time_s, problem_.sightings.back().time_s + x.time_offset_s + kPad);
    const auto segments = static_cast<std::size_t>((to - from) / x.spline.interval_s);
    x.spline.start_s = from;
    x.spline.controls.resize(segments + kOrder - 1);
    for (std::size_t i = 0; i < x.spline.controls.size(); ++i) {
      const RigidTransform T_TC = cameraAt(x.spline.timeOf(i) - x.time_offset_s);
      x.spline.controls[i] = T_TC * RigidTransform(x.q_BC, x.p_BC).inverse();
    }
    for (const ImuReading& r : near_) {
      if (x.spline.covers(r.time_s)) problem_.readings.push_back(r);
    }
    std::erase_if(problem_.sightings, [&](const Sighting& s) {
      return !x.spline.covers(s.time_s + x.time_offset_s - 0.2 * kPad) ||
             !x.spline.covers(s.time_s + x.time_offset_s + 0.2 * kPad);
    });
  }

  RigidTransform cameraAt(double t) const {
    const auto after = std::upper_bound(poses_.begin() + 1, poses_.end() - 1, t,
                                        [](double at, const auto& p) { return at < p.time_s; });
    const auto &a = *(after - 1), &b = *after;
    const double s = std::clamp((t - a.time_s) / (b.time_s - a.time_s), 0.0, 1.0);
    return interpolate(a.T_TC, b.T_TC, s);
  }

  Result<void> solve() {
    const auto failed = fail("calibrate_no_convergence",
                             "the trajectory fits images and samples nowhere; are camera and IMU "
                             "on one rigid body, and is --board as it was printed?");
    double before = problem_.x.time_offset_s;
    problem_.gateCorners(1e9);
    for (int round = 0; round < kRounds; ++round) {
      if (!problem_.solve(round == 0 ? 40 : 15)) return failed;
      weigh();
      const bool settled = std::abs(problem_.x.time_offset_s - before) < kSettled;
      before = problem_.x.time_offset_s;
      if (round > 1 && settled) break;
    }
    return {};
  }

  /// Sets the standard deviations from the residuals; those of the IMU are at least the declared
  /// ones.
  void weigh() {
    std::vector<double> sizes;
    for (const auto& r : problem_.cornerResiduals()) sizes.push_back(r.residual.norm());
    constexpr double kRayleighMedian = 1.1774;
    const double typical = std::max(kLeastPx, medianOf(sizes) / kRayleighMedian);
    problem_.gateCorners(std::max(kGateSigma * typical, 10.0 * kLeastPx));
    problem_.sigma.px = std::max(kLeastPx, cornerRms());
    const auto left = problem_.imuResiduals();
    const double freed = freedomOf(left.size());
    problem_.sigma.gyro =
        std::max(declared_.gyro, rmsOf(left, &ImuResidual::gyro).norm() / std::sqrt(3.0) * freed);
    problem_.sigma.accel =
        std::max(declared_.accel, rmsOf(left, &ImuResidual::accel).norm() / std::sqrt(3.0) * freed);
  }

  /// Ratio of the noise to the residuals, by the degrees of freedom of the spline.
  double freedomOf(std::size_t samples) const {
    const auto n = static_cast<double>(samples);
    const auto controls = static_cast<double>(problem_.x.spline.controls.size());
    return std::sqrt(n / std::max(1.0, n - controls));
  }

  double cornerRms() const {
    double sum = 0.0;
    const auto all = problem_.cornerResiduals();
    for (const auto& r : all) sum += r.residual.squaredNorm();
    return std::sqrt(sum / (2.0 * static_cast<double>(std::max<std::size_t>(1, all.size()))));
  }

  Result<CameraImu> report() {
    const auto certainty = problem_.certainty();
    if (!certainty) return tl::unexpected(certainty.error());
    const Unknowns& x = problem_.x;
    CameraImu out;
    out.camera = input_.camera;
    out.camera.T_BC = RigidTransform(x.q_BC, x.p_BC);
    out.camera.time_offset_s = x.time_offset_s;
    setLens(x.lens, out.camera);
    out.covariance = certainty->calibration;
    out.widened = certainty->widened;
    out.gyro_bias = problem_.biasMean(x.gyro_bias),
    out.accel_bias = problem_.biasMean(x.accel_bias);
    out.gyro_bias_sigma = certainty->gyro_bias, out.accel_bias_sigma = certainty->accel_bias;
    out.gravity_T = options_.gravity * x.down_T;
    out.from_s = problem_.sightings.front().time_s, out.to_s = problem_.sightings.back().time_s;
    out.knot_interval_s = x.spline.interval_s;
    out.sigma_px = problem_.sigma.px;
    out.views = problem_.sightings.size(), out.samples = problem_.readings.size();
    out.residuals = problem_.cornerResiduals();
    out.imu_residuals = problem_.imuResiduals();
    out.corners = out.residuals.size();
    for (const auto& s : problem_.sightings) {
      out.outliers += static_cast<std::size_t>(std::ranges::count(s.good, false));
    }
    checkNoise(out);
    measureMotion(out);
    out.spline = x.spline;
    return out;
  }

  void checkNoise(CameraImu& out) const {
    const double freed = freedomOf(out.imu_residuals.size());
    const auto ratio = [&](Eigen::Vector3d ImuResidual::*which, double declared) {
      return rmsOf(out.imu_residuals, which).norm() / std::sqrt(3.0) * freed / declared;
    };
    out.gyro = {ratio(&ImuResidual::gyro, declared_.gyro),
                correlationOf(out.imu_residuals, &ImuResidual::gyro)};
    out.accel = {ratio(&ImuResidual::accel, declared_.accel),
                 correlationOf(out.imu_residuals, &ImuResidual::accel)};
  }

  void measureMotion(CameraImu& out) const {
    const auto& readings = problem_.readings;
    const auto n = static_cast<double>(readings.size());
    Eigen::Vector3d rate = Eigen::Vector3d::Zero(), accel = rate;
    for (const ImuReading& r : readings) {
      rate += (r.gyro - out.gyro_bias).cwiseAbs2() / n;
      const Eigen::Vector3d gravity_B =
          problem_.x.spline.poseAt(r.time_s).q.conjugate() * out.gravity_T;
      accel += (r.accel - out.accel_bias + gravity_B).cwiseAbs2() / n;
    }
    out.rate_rms_B = rate.cwiseSqrt(), out.accel_rms_B = accel.cwiseSqrt();
  }

  const CameraImuInput& input_;
  CameraImuOptions options_;
  CameraImuProblem problem_;
  Deviations declared_;
  std::vector<CameraPose> poses_;
  std::vector<ImuReading> near_;
};

}  // namespace

Result<CameraImu> estimateCameraImu(const CameraImuInput& input, const CameraImuOptions& options) {
  return CameraImuRun(input, options).run();
}

}  // namespace perdure::calibrate
