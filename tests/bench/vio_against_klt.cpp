// Compares vio's time for each frame of a dataset with the time in which OpenCV follows 200 points.
// Both are CPU times of this thread, without decoding. On a shared machine the ratio is more
// reliable than the times.
// usage: vio_against_klt DATASET
#include <algorithm>
#include <cstdio>
#include <opencv2/core/utility.hpp>
#include <vector>

#include "common/replay/dataset.h"
#include "common/vision/image.h"
#include "services/vio/node.h"
#include "tests/bench/plain_tracker.h"

namespace {

using namespace perdure;

using bench::cpuMs;
using bench::PlainTracker;

double quantile(std::vector<double> values, double q) {
  const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

void print(const char* what, const std::vector<double>& ms) {
  std::printf("%-28s median %6.2f ms   p99 %6.2f ms\n", what, quantile(ms, 0.5),
              quantile(ms, 0.99));
}

int compare(const char* folder) {
  cv::setNumThreads(1);
  replay::DatasetOptions options;
  options.path = folder;
  options.encoding = options.second_encoding = ImageEncoding::kMono8;
  const auto dataset = replay::Dataset::open(options);
  vio::Node node(vio::Config{}, 1, {[](const Odometry&) {}, [](const Landmarks&) {}});
  node.onCalibration(dataset->calibration());
  PlainTracker tracker;
  std::vector<double> vio_ms, klt_ms;
  double since = 0.0;  // vio may process a frame at a later sample
  while (const auto message = dataset->next()) {
    const double begin = cpuMs();
    if (const auto* imu = std::get_if<ImuSample>(&*message)) node.onImu(*imu);
    if (const auto* speed = std::get_if<SpeedSample>(&*message)) node.onSpeed(*speed);
    const auto* frame = std::get_if<Frame>(&*message);
    if (frame) node.onFrame(*frame);
    since += cpuMs() - begin;
    if (!frame || frame->camera != dataset->calibration().cameras[0].name) continue;
    vio_ms.push_back(since);
    since = 0.0;
    const auto image = vision::monoOf(*frame);
    if (!image) continue;
    const double klt = cpuMs();
    tracker.follow(*image);
    klt_ms.push_back(cpuMs() - klt);
  }
  if (vio_ms.empty() || klt_ms.empty()) {
    std::fprintf(stderr, "%s holds no frames that can be read\n", folder);
    return 66;
  }
  print("vio", vio_ms);
  print("OpenCV alone, 200 points", klt_ms);
  std::printf("ratio of the medians %.2f over %zu frames\n",
              quantile(vio_ms, 0.5) / quantile(klt_ms, 0.5), vio_ms.size());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || argv[1][0] == '-') {
    std::fprintf(stderr,
                 "usage: vio_against_klt DATASET (EuRoC, KITTI raw or a simulated folder)\n");
    return 64;
  }
  try {
    return compare(argv[1]);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 66;
  }
}
