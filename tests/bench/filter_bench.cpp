// Measures the CPU time and heap allocations of the filter for each frame, at several numbers of
// objects in view. A camera drives through a field of chairs, people and cars. The network misses
// one detection in ten and reports false boxes. The poses drift, and their covariances state it.
// Uses one thread.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>

#include "common/base/heap.h"
#include "common/config/fields.h"
#include "tests/bench/filter_drive.h"

namespace perdure::semantic_filter::bench {
namespace {

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

Config configure(const std::vector<std::string>& assignments) {
  Config config;
  config::Fields fields;
  describe(config, fields);
  for (const auto& one : assignments) config::refuse(config::assign(fields, one));
  return config;
}

void report(const Config& config, std::size_t asked, int frames) {
  Drive drive(config, asked, 1);
  constexpr std::uint64_t kWarmUp = 60;
  for (std::uint64_t k = 0; k < kWarmUp; ++k) drive.frame(k);
  std::vector<double> ms, allocations, in_view, boxes, objects;
  for (int i = 0; i < frames; ++i) {
    const Sample s = drive.frame(kWarmUp + static_cast<std::uint64_t>(i));
    ms.push_back(s.cpu_ms);
    allocations.push_back(static_cast<double>(s.allocations));
    in_view.push_back(static_cast<double>(s.in_view));
    objects.push_back(static_cast<double>(s.objects));
    boxes.push_back(static_cast<double>(s.boxes));
  }
  std::cout << fmt::format("{:>8.0f} {:>8.0f} {:>8.0f} {:>10.2f} {:>10.2f} {:>12.0f}\n",
                           quantile(in_view, 0.5), quantile(objects, 0.5), quantile(boxes, 0.5),
                           quantile(ms, 0.5), quantile(ms, 0.99), quantile(allocations, 0.5))
            << std::flush;
}

}  // namespace
}  // namespace perdure::semantic_filter::bench

int main(int argc, char** argv) {
  using namespace perdure::semantic_filter;
  const int frames = argc > 1 ? std::atoi(argv[1]) : 200;
  const int in_view = argc > 2 ? std::atoi(argv[2]) : 0;
  if (frames < 1 || in_view < 0) {
    std::cerr
        << "usage: filter_bench [FRAMES [IN_VIEW [KEY=VALUE]…]]   (from the repository's root;"
           " all numbers in view with 0; keys as in config/semantic_filter.yaml)\n";
    return 64;
  }
  perdure::keepFreedMemory();  // perdure-semantic-filter does this too
  try {
    const Config config = bench::configure({argv + std::min(argc, 3), argv + argc});
    std::cout << " in view  objects    boxes  median ms     p99 ms  allocations\n";
    for (const int n : {20, 60, 200}) {
      if (in_view == 0 || in_view == n) bench::report(config, static_cast<std::size_t>(n), frames);
    }
  } catch (const std::exception& e) {
    std::cerr << e.what() << '\n';
    return 64;
  }
}
