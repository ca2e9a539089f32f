#include "services/vio/core/update/standstill.h"

#include <algorithm>
#include <cmath>

#include "services/vio/core/update/updates.h"

namespace perdure::vio {
namespace {

// Allowed change of speed and angle over a window, in addition to noise, because a body at rest
// rocks slightly.
constexpr double kSpeedGain = 0.02, kTurnGain = 0.002;  // m/s, rad
constexpr double kDeviations = 3.8;                     // root of χ² of three axes at 0.998
constexpr std::chrono::milliseconds kShort{500}, kLong{2000};
// This must be shorter than kLong, so that at a smooth departure the long window still contains the
// acceleration.
constexpr std::chrono::milliseconds kLongestPush{1000};
constexpr std::chrono::seconds kLongestUnseen{120};

bool reachesBack(const ImuBuffer& imu, TimePoint now, Duration window) {
  constexpr std::chrono::milliseconds kSlack{20};
  return !imu.empty() && window.count() > 0 && imu.first() <= now - window + kSlack;
}

bool agree(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double sigma, double floor) {
  return (a - b).norm() <= floor + kDeviations * sigma;
}

double squared(double x) { return x * x; }

/// The means, with deviations from the differences of successive samples: of a motion that is slow
/// against the samples, such as steps, nothing counts as noise.
RestSample evenSample(const std::vector<ImuReading>& readings, const ImuNoise& noise) {
  RestSample s = restSample(readings, noise);
  double rate2 = 0.0, force2 = 0.0;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    rate2 += (readings[i].gyro - readings[i - 1].gyro).squaredNorm() / 6.0;
    force2 += (readings[i].accel - readings[i - 1].accel).squaredNorm() / 6.0;
  }
  const double n = static_cast<double>(readings.size());
  const double dt = toSeconds(readings.back().time - readings.front().time);
  const double credit = std::max(1.0, n / 4.0) * (n - 1.0);  // as restSample()
  s.rate_sigma = std::sqrt(squared(noise.gyro) / dt + rate2 / credit);
  s.force_sigma = std::sqrt(squared(noise.accel) / dt + force2 / credit);
  return s;
}

}  // namespace

RestExpectation restExpectation(const State& state, double gravity) {
  Eigen::Matrix<double, 6, 9> J;
  const Eigen::Matrix<double, 6, 1> z = restPrediction(state.nav, gravity, &J);
  const Eigen::Matrix<double, 9, 9> P =
      state.covarianceOf({{kTheta, 3}, {kGyroBias, 3}, {kAccelBias, 3}});
  const Eigen::Matrix<double, 6, 6> S = J * P * J.transpose();
  const auto deviation = [](const auto& variances) { return std::sqrt(variances.maxCoeff()); };
  return {z.head<3>(), z.tail<3>(), deviation(S.diagonal().head<3>()),
          deviation(S.diagonal().tail<3>())};
}

bool imuRests(const ImuBuffer& imu, TimePoint now, Duration window, const RestExpectation& expected,
              Duration age, const ImuNoise& noise) {
  if (!reachesBack(imu, now, window)) return false;
  const RestSample mean = restSample(imu.between(now - window, now), noise);
  const double T = toSeconds(window), walked_s = toSeconds(age);
  const double rate_sigma = std::sqrt(squared(mean.rate_sigma) + squared(expected.rate_sigma) +
                                      squared(noise.gyro_walk) * walked_s);
  const double force_sigma = std::sqrt(squared(mean.force_sigma) + squared(expected.force_sigma) +
                                       squared(noise.accel_walk) * walked_s);
  return agree(mean.rate, expected.rate, rate_sigma, kTurnGain / T) &&
         agree(mean.force, expected.force, force_sigma, kSpeedGain / T);
}

bool imuIsEven(const ImuBuffer& imu, TimePoint now, Duration window, const ImuNoise& noise) {
  if (!reachesBack(imu, now, window)) return false;
  const Duration half = window / 2;
  const RestSample a = evenSample(imu.between(now - window, now - half), noise);
  const RestSample b = evenSample(imu.between(now - half, now), noise);
  const double T = toSeconds(half);
  return agree(a.rate, b.rate, std::hypot(a.rate_sigma, b.rate_sigma), kTurnGain / T) &&
         agree(a.force, b.force, std::hypot(a.force_sigma, b.force_sigma), kSpeedGain / T);
}

void Standstill::confirm(TimePoint now, const RestExpectation& expected) {
  if (!confirmed_) {
    begun_ = now;
    reference_ = next_ = {now, expected};
  }
  confirmed_ = now;
  interrupted_.reset();
  if (now - next_.time < kLong) return;
  reference_ = next_;
  next_ = {now, expected};
}

bool Standstill::holds(const ImuBuffer& imu, TimePoint now, const ImuNoise& noise) {
  if (!confirmed_) return false;
  if (now - *confirmed_ > kLongestUnseen) {
    forget();
    return false;
  }
  // The windows must not include the motion before this standstill.
  const auto rests = [&](Duration window) {
    return imuRests(imu, now, std::min(window, now - begun_), reference_.expected,
                    now - reference_.time, noise);
  };
  if (rests(kShort) && rests(kLong)) {
    interrupted_.reset();
    return true;
  }
  if (!interrupted_) interrupted_ = now;
  if (now - *interrupted_ > kLongestPush) forget();
  return false;
}

}  // namespace perdure::vio
