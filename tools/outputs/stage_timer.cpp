#include "tools/outputs/stage_timer.h"

#include <time.h>

#include <numeric>

namespace perdure::tools {
namespace {

double nowMs(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

nlohmann::ordered_json summary(const std::vector<double>& values, double begun) {
  return {{"median", quantile(values, 0.5)},
          {"p99", quantile(values, 0.99)},
          {"total", std::accumulate(values.begin(), values.end(), begun)}};
}

}  // namespace

StageTimer::Span::Span(StageTimer& timer, const std::string& stage, bool whole)
    : timer_(timer),
      stage_(stage),
      whole_(whole),
      outer_(timer.innermost_),
      cpu_start_ms_(nowMs(CLOCK_PROCESS_CPUTIME_ID)),
      wall_start_ms_(nowMs(CLOCK_MONOTONIC)) {
  timer_.innermost_ = this;
}

StageTimer::Span::~Span() {
  const double cpu = nowMs(CLOCK_PROCESS_CPUTIME_ID) - cpu_start_ms_;
  const double wall = nowMs(CLOCK_MONOTONIC) - wall_start_ms_;
  timer_.innermost_ = outer_;
  if (outer_) {
    outer_->cpu_within_ms_ += cpu;
    outer_->wall_within_ms_ += wall;
  }
  Samples& samples = timer_.stages_[stage_];
  samples.cpu_begun_ms += cpu - cpu_within_ms_;
  samples.wall_begun_ms += wall - wall_within_ms_;
  if (!whole_) return;
  samples.cpu_ms.push_back(samples.cpu_begun_ms);
  samples.wall_ms.push_back(samples.wall_begun_ms);
  samples.cpu_begun_ms = samples.wall_begun_ms = 0.0;
}

nlohmann::ordered_json StageTimer::toJson() const {
  nlohmann::ordered_json stages = nlohmann::ordered_json::object();
  for (const auto& [name, samples] : stages_) {
    stages[name] = {{"calls", samples.cpu_ms.size()},
                    {"cpu_ms", summary(samples.cpu_ms, samples.cpu_begun_ms)},
                    {"wall_ms", summary(samples.wall_ms, samples.wall_begun_ms)}};
  }
  return {{"stages", stages}};
}

}  // namespace perdure::tools
