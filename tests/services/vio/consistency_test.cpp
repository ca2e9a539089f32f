// Tests whether the filter's covariance matches its errors: seeded runs of one minute. All
// quantities in the covariance are drawn from the distributions that the filter assumes.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "common/math/chi2.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/vio/core/estimator.h"
#include "services/vio/core/start/initialiser.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using Eigen::Vector3d;

constexpr int kRuns = 30, kFewRuns = 8;
constexpr std::array<int, 6> kSeconds{10, 20, 30, 40, 50, 60};
constexpr std::array<const char*, 3> kWhat{"orientation", "position", "velocity"};

/// NEES of orientation, position and velocity at each of kSeconds; NEES of the gyroscope's scale at
/// the end.
struct Nees {
  std::array<std::array<double, 3>, kSeconds.size()> at{};
  double scale = 0.0;
};

class Draws {
 public:
  explicit Draws(unsigned seed) : random_(seed) {}
  double one(double sigma) { return sigma * normal_(random_); }
  Vector3d three(double sigma) { return {one(sigma), one(sigma), one(sigma)}; }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// Runs one minute after a start at rest. W is aligned with the truth at the first output, by yaw
/// and position.
Nees run(unsigned seed, test::DrivePlace place, double gyro_scale) {
  Options options;
  options.calibration.gyro_scale = gyro_scale;
  const CalibrationOptions& calibration = options.calibration;
  Draws draws(1000 + seed);
  test::DriveOptions drive_options;
  drive_options.place = place;
  drive_options.seed = seed;
  drive_options.camera_rate_hz = 10.0;
  drive_options.rest_s = 1.0;
  drive_options.walking_biases = true;
  drive_options.gyro_bias = draws.three(0.02);
  drive_options.accel_bias = draws.three(options.start.accel_bias_sigma);
  drive_options.time_offset_s = draws.one(calibration.time_offset_s);
  drive_options.gyro_scale += Draws(5000 + seed).three(gyro_scale);
  test::SimulatedDrive drive(drive_options);
  ImuBuffer imu;
  for (const ImuReading& r : drive.imu(kSeconds.back() + 1.0)) EXPECT_TRUE(imu.add(r));
  std::vector<RigidTransform> T_BC = drive.T_BC();
  for (RigidTransform& T : T_BC) {
    Eigen::Matrix<double, 6, 1> error;
    error << draws.three(calibration.extrinsic_rotation),
        draws.three(calibration.extrinsic_position_m);
    T = boxPlus(T, error);
  }
  Estimator estimator(options, T_BC, 0.0);
  const auto start = startAtRest(imu, drive.time(0.6), options);
  EXPECT_TRUE(start);
  estimator.start(*start);
  const Nav begin = drive.truth(0.6);
  const Eigen::Matrix3d turn =
      rotationAboutZ(yawOf(start->nav.q_WB.toRotationMatrix()) - yawOf(begin.T_WB().R()));
  Nees result{};
  std::size_t next = 0;
  for (std::uint64_t frame = 7; next < kSeconds.size(); ++frame) {
    const double t = 0.1 * static_cast<double>(frame);
    FrameInput input{frame, drive.time(t), drive.see(t), {}, {}};
    if (t < drive_options.rest_s) input.motion_px = 0.0;
    const auto out = estimator.process(input, imu);
    EXPECT_TRUE(out) << out.error().code;
    if (!out) break;
    if (t < kSeconds[next] - 0.05) continue;
    const Nav truth = drive.truth(t + drive_options.time_offset_s);
    const Eigen::Quaterniond q_WB(turn * truth.q_WB.toRotationMatrix());
    const std::array<Vector3d, 3> errors{logSo3(out->nav.q_WB.conjugate() * q_WB),
                                         Vector3d(turn * (truth.p_WB - begin.p_WB) - out->nav.p_WB),
                                         Vector3d(turn * truth.v_WB - out->nav.v_WB)};
    for (int what = 0; what < 3; ++what) {
      result.at[next][static_cast<std::size_t>(what)] = squaredMahalanobis(
          errors[static_cast<std::size_t>(what)], out->covariance.block<3, 3>(3 * what, 3 * what));
    }
    ++next;
  }
  if (const auto at = estimator.state().scaleAt()) {
    result.scale =
        squaredMahalanobis(Vector3d(drive_options.gyro_scale - estimator.state().gyro_scale),
                           Eigen::Matrix3d(estimator.state().P().block<3, 3>(*at, *at)));
  }
  return result;
}

void expectNineTenthsInTheirBand(test::DrivePlace place, int runs, double gyro_scale = 0.0) {
  std::array<std::array<double, 3>, kSeconds.size()> sum{};
  double scale = 0.0;
  for (int seed = 1; seed <= runs; ++seed) {
    const Nees nees = run(static_cast<unsigned>(seed), place, gyro_scale);
    scale += nees.scale;
    for (std::size_t k = 0; k < kSeconds.size(); ++k) {
      for (std::size_t what = 0; what < 3; ++what) sum[k][what] += nees.at[k][what];
    }
  }
  const double low = chi2Quantile(0.025, 3 * runs), high = chi2Quantile(0.975, 3 * runs);
  int inside = 0, asked = 0;
  for (std::size_t k = 0; k < kSeconds.size(); ++k) {
    for (std::size_t what = 0; what < 3; ++what) {
      const bool in = sum[k][what] > low && sum[k][what] < high;
      inside += in;
      ++asked;
      std::printf("%2d s %-12s %.2f %s (%.2f … %.2f)\n", kSeconds[k], kWhat[what],
                  sum[k][what] / (3 * runs), in ? "in" : "out", low / (3 * runs),
                  high / (3 * runs));
    }
  }
  EXPECT_GE(10 * inside, 9 * asked);
  if (gyro_scale == 0.0) return;
  std::printf("gyroscope's scale %.2f (%.2f … %.2f)\n", scale / (3 * runs), low / (3 * runs),
              high / (3 * runs));
  EXPECT_GT(scale, low);
  EXPECT_LT(scale, high);
}

TEST(Consistency, NineTenthsOfTheMeanErrorsOfAFewRunsLieInTheirBand) {
  expectNineTenthsInTheirBand(test::DrivePlace::kRoom, kFewRuns);
}

// At constant velocity, scale is unobservable. Only the information from the start at rest remains,
// and the covariance must show its decay.
TEST(Consistency, AFewRunsHoldAtConstantVelocityWithoutSpeed) {
  expectNineTenthsInTheirBand(test::DrivePlace::kStreet, kFewRuns);
}

TEST(LongConsistency, HoldsWithAGyroscopeWhoseScaleIsOff) {
  expectNineTenthsInTheirBand(test::DrivePlace::kRoom, kRuns, 0.01);
}

TEST(LongConsistency, NineTenthsOfTheMeanErrorsLieInTheirBand) {
  expectNineTenthsInTheirBand(test::DrivePlace::kRoom, kRuns);
}

TEST(LongConsistency, HoldsAtConstantVelocityWithoutSpeed) {
  expectNineTenthsInTheirBand(test::DrivePlace::kStreet, kRuns);
}

/// The vibration of rotors: a sinusoid on each axis with amplitude up to `largest`.
class Rotors {
 public:
  Rotors(unsigned seed, double largest) : largest_(largest) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(0.0, 1.0);
    for (int axis = 0; axis < 3; ++axis) {
      amplitude_[axis] = u(random);
      hertz_[axis] = 60.0 + 120.0 * u(random);
      phase_[axis] = 2.0 * M_PI * u(random);
    }
  }
  Vector3d at(double t) const {
    return largest_ * (amplitude_.array() * (2.0 * M_PI * t * hertz_ + phase_).array().sin());
  }

 private:
  double largest_;
  Vector3d amplitude_, hertz_, phase_;
};

// The filter assumes a velocity of rest of 2 cm/s; the vibration of hovering is smaller. The NEES
// of the velocity may therefore be below its band, that of the tilt may not.
TEST(Consistency, AStartAtRestWithRotorsRunningIsUsableWithinASecond) {
  double tilt_nees = 0.0, velocity_nees = 0.0, largest_velocity = 0.0;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const Options options;
    Draws draws(2000 + seed);
    test::DriveOptions drive_options;
    drive_options.seed = seed;
    drive_options.rest_s = 3.0;
    drive_options.walking_biases = true;
    drive_options.gyro_bias = draws.three(0.02);
    drive_options.accel_bias = draws.three(options.start.accel_bias_sigma);
    test::SimulatedDrive drive(drive_options);
    const Rotors force(3000 + seed, 0.7), rate(4000 + seed, 0.05);
    ImuBuffer imu;
    for (ImuReading r : drive.imu(1.5)) {
      const double t = toSeconds(r.time - drive.time(0.0));
      r.accel += force.at(t);
      r.gyro += rate.at(t);
      ASSERT_TRUE(imu.add(r));
    }
    const auto start = startAtRest(imu, drive.time(0.55), options);
    ASSERT_TRUE(start) << start.error().code;
    Estimator estimator(options, drive.T_BC(), 0.0);
    estimator.start(*start);
    std::optional<FrameEstimate> last;
    for (std::uint64_t frame = 1; frame <= 9; ++frame) {  // up to t = 1 s
      const double t = 0.55 + 0.05 * static_cast<double>(frame);
      FrameInput input{frame, drive.time(t), drive.see(t), {}, {}};
      input.motion_px = 0.0;
      const auto out = estimator.process(input, imu);
      ASSERT_TRUE(out) << out.error().code;
      last = *out;
    }
    const Nav truth = drive.truth(1.0);
    const Eigen::Matrix3d turn = rotationAboutZ(yawOf(last->nav.q_WB.toRotationMatrix()) -
                                                yawOf(truth.q_WB.toRotationMatrix()));
    const Eigen::Quaterniond q_WB(turn * truth.q_WB.toRotationMatrix());
    // Uses only the two tilt components, because yaw is a gauge of W.
    const Vector3d theta = last->nav.q_WB * logSo3(last->nav.q_WB.conjugate() * q_WB);
    const Eigen::Matrix3d R = last->nav.q_WB.toRotationMatrix();
    const Eigen::Matrix3d P = R * last->covariance.topLeftCorner<3, 3>() * R.transpose();
    tilt_nees += squaredMahalanobis(Eigen::Vector2d(theta.head<2>()),
                                    Eigen::Matrix2d(P.topLeftCorner<2, 2>()));
    velocity_nees += squaredMahalanobis(last->nav.v_WB, last->covariance.bottomRightCorner<3, 3>());
    largest_velocity = std::max(largest_velocity, last->nav.v_WB.norm());
  }
  std::printf("tilt %.2f (%.2f … %.2f), velocity %.3f, at most %.4f m/s\n", tilt_nees / (2 * kRuns),
              chi2Quantile(0.025, 2 * kRuns) / (2 * kRuns),
              chi2Quantile(0.975, 2 * kRuns) / (2 * kRuns), velocity_nees / (3 * kRuns),
              largest_velocity);
  EXPECT_GT(tilt_nees, chi2Quantile(0.025, 2 * kRuns));
  EXPECT_LT(tilt_nees, chi2Quantile(0.975, 2 * kRuns));
  EXPECT_LT(velocity_nees, chi2Quantile(0.975, 3 * kRuns));
  EXPECT_LT(largest_velocity, 0.1);
}

}  // namespace
}  // namespace perdure::vio
