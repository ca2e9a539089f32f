// Times the stages of vio on simulated input and counts their heap allocations per iteration: `own`
// by the project's code and Eigen, `opencv` inside OpenCV. Uses one thread.
#include <benchmark/benchmark.h>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "services/vio/core/propagation/imu_propagator.h"
#include "services/vio/core/start/initialiser.h"
#include "services/vio/core/start/motion_initialiser.h"
#include "services/vio/core/tracks/descriptor.h"
#include "services/vio/core/tracks/tracker.h"
#include "services/vio/core/update/point_updates.h"
#include "tests/bench/allocations.h"
#include "tests/bench/vio_stages.h"

namespace perdure::vio::bench {
namespace {

using tests::allocations;
using tests::allocationsSince;

/// Times `work`; calls `prepare` before each call of it, untimed and uncounted.
template <class Prepare, class Work>
void measure(benchmark::State& loop, const Prepare& prepare, const Work& work) {
  tests::Allocations sum;
  for (auto _ : loop) {
    loop.PauseTiming();
    prepare();
    const tests::Allocations before = allocations();
    loop.ResumeTiming();
    work();
    loop.PauseTiming();
    const tests::Allocations made = allocationsSince(before);
    sum.own += made.own;
    sum.opencv += made.opencv;
    loop.ResumeTiming();
  }
  const auto mean = [](std::uint64_t n) {
    return benchmark::Counter(static_cast<double>(n), benchmark::Counter::kAvgIterations);
  };
  loop.counters["own"] = mean(sum.own);
  loop.counters["opencv"] = mean(sum.opencv);
}

template <class Work>
void measure(benchmark::State& loop, const Work& work) {
  measure(
      loop, [] {}, work);
}

/// Returns a filter with one camera, or with two (argument 1).
const RunningFilter& filter(const benchmark::State& loop) {
  static const RunningFilter one(false), two(true);
  return loop.range(0) == 0 ? one : two;
}

void trackImage(benchmark::State& loop) {
  PassingImages images;
  Tracker tracker(TrackerOptions{}, {CameraModel(test::testCamera(0))});
  const Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  for (int k = 0; k < 60; ++k) tracker.track(images.next(), {}, R);
  std::size_t points = 0;
  const cv::Mat* image = nullptr;
  measure(
      loop, [&] { image = &images.next(); },
      [&] { points = tracker.track(*image, {}, R).points.size(); });
  loop.counters["points"] = static_cast<double>(points);
}

/// The time of OpenCV alone for 200 points: the pyramid of one image and Lucas-Kanade. Arguments:
/// side of the window, levels above the image, iterations.
void opencvKlt(benchmark::State& loop) {
  const cv::Size window(static_cast<int>(loop.range(0)), static_cast<int>(loop.range(0)));
  const int levels = static_cast<int>(loop.range(1));
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS,
                                  static_cast<int>(loop.range(2)), 0.01);
  PassingImages images;
  std::vector<cv::Mat> before, now;
  std::vector<cv::Point2f> from, to;
  std::vector<std::uint8_t> status;
  const cv::Mat* image = &images.next();
  measure(
      loop,
      [&] {
        cv::goodFeaturesToTrack(*image, from, 200, 0.001, 12.0);
        cv::buildOpticalFlowPyramid(*image, before, window, levels);
        image = &images.next();
      },
      [&] {
        cv::buildOpticalFlowPyramid(*image, now, window, levels);
        cv::calcOpticalFlowPyrLK(before, now, from, to, status, cv::noArray(), window, levels,
                                 criteria);
      });
  loop.counters["points"] = static_cast<double>(from.size());
}

void ransac(benchmark::State& loop) {
  const std::vector<Match> matches = someMatches();
  measure(loop, [&] {
    benchmark::DoNotOptimize(twoPointRansac(matches, Eigen::Matrix3d::Identity(), 1.5));
  });
}

void describe(benchmark::State& loop) {
  const RunningFilter& run = filter(loop);
  const cv::Mat image = test::texture(4);
  measure(loop, [&] {
    for (const TrackedPoint& p : run.input().tracked.points) {
      benchmark::DoNotOptimize(descriptorAt(image, p.seen[0]->pixel));
    }
  });
}

void propagateFrame(benchmark::State& loop) {
  const RunningFilter& run = filter(loop);
  State state = run.estimator().state();
  const TimePoint to = run.input().image_time + durationFromSeconds(state.time_offset_s);
  std::vector<ImuReading> readings = run.imu().between(state.time, to);
  measure(
      loop, [&] { state = run.estimator().state(); },
      [&] {
        run.imu().between(state.time, to, readings);
        const ImuIncrement x =
            integrate(readings, state.nav.gyro_bias, state.nav.accel_bias, run.options().imu);
        propagate(state, x, to, run.options().gravity, true);
      });
}

void cloneAndForget(benchmark::State& loop) {
  const RunningFilter& run = filter(loop);
  State state = run.estimator().state();
  measure(
      loop, [&] { state = run.estimator().state(); },
      [&] {
        state.addClone(run.input().frame, run.input().image_time, Eigen::Vector3d::Zero(), true);
        state.removeClone(state.clones.front().frame);
      });
}

/// The second argument is the number of tracks.
void msckf(benchmark::State& loop) {
  const RunningFilter& run = filter(loop);
  const std::vector<const Track*> tracks = run.tracks(static_cast<std::size_t>(loop.range(1)));
  State state = run.cloned();
  ReasonCounts reasons;
  int used = 0;
  measure(
      loop, [&] { state = run.cloned(); },
      [&] { used = updateMsckf(state, tracks, run.options().vision, reasons)->used; });
  loop.counters["points"] = used;
}

void slam(benchmark::State& loop) {
  const RunningFilter& run = filter(loop);
  State state = run.cloned();
  ReasonCounts reasons;
  int used = 0;
  measure(
      loop, [&] { state = run.cloned(); },
      [&] { used = updateSlam(state, run.database(), run.options().vision, true, reasons)->used; });
  loop.counters["points"] = used;
}

void wholeFrame(benchmark::State& loop) {
  const RunningFilter& run = filter(loop);
  const std::vector<FrameInput> inputs = run.inputs();
  Estimator estimator = run.warmed();
  std::size_t at = 0, frames = 0, points = 0;
  measure(
      loop,
      [&] {
        if (at < inputs.size()) return;
        estimator = run.warmed();
        at = 0;
      },
      [&] {
        const auto done = estimator.process(inputs[at++], run.imu());
        points += static_cast<std::size_t>(done->points_used);
        ++frames;
      });
  loop.counters["points"] = static_cast<double>(points) / static_cast<double>(frames);
}

void landmarks(benchmark::State& loop) {
  const RunningFilter& run = filter(loop);
  std::size_t points = 0;
  measure(loop, [&] { points = run.estimator().landmarks().size(); });
  loop.counters["points"] = static_cast<double>(points);
}

void restStart(benchmark::State& loop) {
  test::DriveOptions options;
  options.rest_s = 5.0;
  test::SimulatedDrive drive(options);
  ImuBuffer imu;
  for (const ImuReading& r : drive.imu(1.0)) benchmark::DoNotOptimize(imu.add(r));
  measure(loop, [&] {
    if (!startAtRest(imu, drive.time(0.9), Options{})) loop.SkipWithError("no start at rest");
  });
}

void motionStart(benchmark::State& loop) {
  const RunningFilter& run = filter(loop);
  MotionInitialiser initialiser(run.options());
  const std::vector<FrameInput> inputs = run.inputs();
  for (std::size_t k = 0; k < 22; ++k) initialiser.add(inputs[k], inputs[k].image_time);
  measure(loop, [&] {
    const auto start = initialiser.start(run.imu(), run.drive().cameras());
    if (!start) loop.SkipWithError(start.error().code.c_str());
  });
}

benchmark::internal::Benchmark* stage(const char* name, void (*run)(benchmark::State&)) {
  return benchmark::RegisterBenchmark(name, run)->Unit(benchmark::kMicrosecond);
}

void registerStages() {
  stage("vio/track", trackImage);
  stage("vio/opencv_klt", opencvKlt)
      ->ArgNames({"window", "levels", "iterations"})
      ->Args({21, 3, 30})
      ->Args({11, 3, 20});
  stage("vio/ransac", ransac);
  stage("vio/descriptors", describe)->ArgName("stereo")->Arg(0);
  stage("vio/propagate", propagateFrame)->ArgName("stereo")->DenseRange(0, 1);
  stage("vio/clone", cloneAndForget)->ArgName("stereo")->DenseRange(0, 1);
  stage("vio/msckf", msckf)->ArgNames({"stereo", "tracks"})->ArgsProduct({{0, 1}, {10, 30}});
  stage("vio/slam", slam)->ArgName("stereo")->DenseRange(0, 1);
  stage("vio/estimator", wholeFrame)->ArgName("stereo")->DenseRange(0, 1);
  stage("vio/landmarks", landmarks)->ArgName("stereo")->DenseRange(0, 1);
  stage("vio/start_at_rest", restStart);
  stage("vio/start_in_motion", motionStart)->ArgName("stereo")->DenseRange(0, 1);
}

}  // namespace
}  // namespace perdure::vio::bench

int main(int argc, char** argv) {
  cv::setNumThreads(1);  // vio also uses one thread
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 64;
  perdure::vio::bench::registerStages();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
