// Counts the heap allocations of a running filter. Propagation and cloning allocate nothing.
// Updates allocate no more after a minute than after some seconds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <vector>

#include "services/vio/core/estimator.h"
#include "services/vio/core/propagation/imu_propagator.h"
#include "tests/bench/allocations.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using tests::allocations;
using tests::allocationsSince;

constexpr double kBegin = 0.2, kFramePeriod = 0.05;

class AllocationTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!tests::allocationsAreCounted()) GTEST_SKIP() << "a sanitizer owns malloc";
  }
};
using Allocations = AllocationTest;
using Propagation = AllocationTest;
using Prediction = AllocationTest;
using StateUpdate = AllocationTest;
using EstimatorAllocations = AllocationTest;

TEST_F(Allocations, OfTheStandardLibraryAndOfEigenAreCounted) {
  const tests::Allocations before = allocations();
  const auto number = std::make_unique<int>(1);
  EXPECT_EQ(allocationsSince(before).own, 1u) << *number;
  const Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(*number + 2, 3);
  EXPECT_EQ(allocationsSince(before).own, 2u) << matrix;
  const cv::Mat image(3, 3, CV_8UC1);
  EXPECT_GT(allocationsSince(before).opencv, 0u) << image.size();
}

ImuBuffer samplesOf(test::SimulatedDrive& drive, double seconds) {
  ImuBuffer imu;
  for (const ImuReading& r : drive.imu(seconds)) EXPECT_TRUE(imu.add(r));
  return imu;
}

Options optionsOfTheService() {
  Options options;
  options.calibration.gyro_scale = 0.01;
  return options;
}

struct RunningFilter {
  test::SimulatedDrive drive;
  ImuBuffer imu;
  Estimator estimator;
  std::uint64_t frame = 0;

  RunningFilter(const test::DriveOptions& options, double seconds)
      : drive(options),
        imu(samplesOf(drive, seconds)),
        estimator(optionsOfTheService(), drive.T_BC(), 0.0) {
    estimator.start(test::startAt(drive, kBegin, options.seed, 1.0));
  }

  double now() const { return kBegin + kFramePeriod * static_cast<double>(frame); }

  /// Processes the next frame and returns its number of allocations.
  std::uint64_t step() {
    ++frame;
    const FrameInput input{frame, drive.time(now()), drive.see(now()), {}, {}};
    const tests::Allocations before = allocations();
    const auto done = estimator.process(input, imu);
    const std::uint64_t made = allocationsSince(before).own;
    EXPECT_TRUE(done) << done.error().code;
    return made;
  }
};

TEST_F(Propagation, AllocatesNothing) {
  for (const bool stereo : {false, true}) {
    test::DriveOptions options;
    options.stereo = stereo;
    RunningFilter run(options, 12.0);
    while (run.frame < 100) run.step();
    State state = run.estimator.state();
    const std::size_t clones = state.clones.size();
    state.clones.reserve(clones + 1);
    ASSERT_GT(state.points.size(), 20u);
    std::vector<ImuReading> readings = run.imu.between(state.time, run.drive.time(run.now() + 0.2));
    const tests::Allocations before = allocations();
    for (std::uint64_t k = 1; k <= 100; ++k) {
      const TimePoint to = state.time + durationFromSeconds(kFramePeriod);
      run.imu.between(state.time, to, readings);
      const ImuIncrement x = integrate(readings, state.nav.gyro_bias, state.nav.accel_bias,
                                       Options{}.imu, state.gyro_scale);
      propagate(state, x, to, Options{}.gravity, true);
      state.addClone(run.frame + k, to, x.end_rate, true);
      state.removeClone(state.clones.front().frame);
    }
    EXPECT_EQ(allocationsSince(before).own, 0u);
    EXPECT_EQ(state.clones.size(), clones);
    EXPECT_TRUE(state.healthy());
  }
}

TEST_F(Prediction, OfTheRotationAllocatesNothing) {
  RunningFilter run({}, 5.0);
  while (run.frame < 60) run.step();
  const TimePoint from = run.estimator.state().time;
  const TimePoint to = run.drive.time(run.now() + kFramePeriod);
  run.estimator.predictRotation(run.imu, from, to);
  const tests::Allocations before = allocations();
  const Eigen::Matrix3d R = run.estimator.predictRotation(run.imu, from, to);
  EXPECT_EQ(allocationsSince(before).own, 0u) << R;
}

TEST_F(StateUpdate, AllocatesNothing) {
  RunningFilter run({}, 7.0);
  while (run.frame < 100) run.step();
  State& state = run.estimator.state();
  const Eigen::MatrixXd H = Eigen::MatrixXd::Identity(12, 12);
  const Eigen::VectorXd r = Eigen::VectorXd::Zero(12);
  const std::vector<Block> blocks{{state.clones[0].at, 6}, {state.clones[1].at, 6}};
  const tests::Allocations before = allocations();
  ASSERT_TRUE(state.update(H, blocks, r));
  EXPECT_EQ(allocationsSince(before).own, 0u);
}

TEST_F(EstimatorAllocations, StayBelowTheirBoundAndDoNotGrowWithTime) {
  for (const bool stereo : {false, true}) {
    test::DriveOptions options;
    options.stereo = stereo;
    RunningFilter run(options, 61.0);
    while (run.frame < 100) run.step();
    const auto next = [&](int frames) {
      std::vector<std::uint64_t> made;
      for (int k = 0; k < frames; ++k) made.push_back(run.step());
      return made;
    };
    const auto mean = [](const std::vector<std::uint64_t>& made) {
      std::uint64_t sum = 0;
      for (const std::uint64_t n : made) sum += n;
      return static_cast<double>(sum) / static_cast<double>(made.size());
    };
    const std::vector<std::uint64_t> early = next(500), late = next(500);
    // A track that is used once allocates about 15 times; a frame uses at most 30 tracks.
    EXPECT_LT(*std::max_element(early.begin(), early.end()), 400u);
    EXPECT_LT(*std::max_element(late.begin(), late.end()), 400u);
    EXPECT_LT(mean(late), 1.2 * mean(early));
    std::printf("%s: mean %.0f, then %.0f; most %ju\n", stereo ? "stereo" : "mono", mean(early),
                mean(late), *std::max_element(late.begin(), late.end()));
  }
}

}  // namespace
}  // namespace perdure::vio
