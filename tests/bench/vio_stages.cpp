#include "tests/bench/vio_stages.h"

#include <algorithm>
#include <random>

#include "common/base/check.h"
#include "services/vio/core/propagation/imu_propagator.h"

namespace perdure::vio::bench {
namespace {

constexpr double kBegin = 0.2, kFramePeriod = 0.05;

test::DriveOptions driveOptions(bool stereo) {
  test::DriveOptions options;
  options.stereo = stereo;
  options.points = 2000;
  options.points_per_image = 150;
  return options;
}

}  // namespace

PassingImages::PassingImages() {
  constexpr int kImages = 30;
  const cv::Mat image = test::texture(4);
  for (int k = 0; k < kImages; ++k) images_.push_back(test::shifted(image, 3.3 * k, -1.1 * k));
  for (int k = kImages - 2; k > 0; --k) images_.push_back(images_[static_cast<std::size_t>(k)]);
}

const cv::Mat& PassingImages::next() { return images_[at_++ % images_.size()]; }

std::vector<Match> someMatches() {
  constexpr int kMatches = 150;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::vector<Match> matches;
  for (int i = 0; i < kMatches; ++i) {
    const Eigen::Vector3d p(3.0 * u(random), 2.0 * u(random), 5.0 + 2.0 * u(random));
    Eigen::Vector2d now = (p + Eigen::Vector3d(0.3, -0.1, 0.2)).hnormalized();
    if (i % 5 == 0) now += Eigen::Vector2d(0.1 * u(random) + 0.05, 0.1 * u(random) - 0.08);
    matches.push_back({p.hnormalized(), now, 450.0});
  }
  return matches;
}

RunningFilter::RunningFilter(bool stereo)
    : drive_(driveOptions(stereo)),
      warm_(options_, drive_.T_BC(), 0.0),
      cloned_(drive_.T_BC(), 0.0, 1, 1) {
  for (const ImuReading& r : drive_.imu(kBegin + kFramePeriod * (kFrames + 2))) {
    check(imu_.add(r).has_value(), "simulated samples are in order");
  }
  for (std::uint64_t k = 1; k <= kFrames; ++k) {
    const double t = kBegin + kFramePeriod * static_cast<double>(k);
    inputs_.push_back({k, drive_.time(t), drive_.see(t), {}, {}});
  }
  warm_ = warmed();
  cloned_ = warm_.state();
  const TimePoint to = input().image_time + durationFromSeconds(cloned_.time_offset_s);
  const ImuIncrement x = integrate(imu_.between(cloned_.time, to), cloned_.nav.gyro_bias,
                                   cloned_.nav.accel_bias, options_.imu);
  propagate(cloned_, x, to, options_.gravity, options_.window.first_estimates);
  cloned_.addClone(input().frame, input().image_time, x.end_rate, options_.window.first_estimates);
  for (const Clone& clone : cloned_.clones) {
    database_.add(clone.frame, inputs_[clone.frame - 1].tracked);
  }
}

Estimator RunningFilter::warmed() const {
  Estimator estimator(options_, drive_.T_BC(), 0.0);
  estimator.start(test::startAt(drive_, kBegin, 1, 1.0));
  for (std::size_t k = 0; k < kWarm; ++k) {
    check(estimator.process(inputs_[k], imu_).has_value(), "the filter follows the drive");
  }
  return estimator;
}

std::vector<const Track*> RunningFilter::tracks(std::size_t count) const {
  std::vector<const Track*> result;
  for (const auto& [id, track] : database_.tracks()) {
    if (!cloned_.point(id)) result.push_back(&track);
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Track* a, const Track* b) { return a->views() > b->views(); });
  if (result.size() > count) result.resize(count);
  return result;
}

}  // namespace perdure::vio::bench
