// Processor and wall time by stage, for timing.json.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace perdure::tools {

/// Middle and upper quantile of a sample by linear interpolation; q in [0, 1]; 0 when empty.
double quantile(std::vector<double> values, double q);

class StageTimer {
 public:
  /// Runs `work` and adds its CPU time (of all threads of the process) and wall time to `stage` as
  /// one call.
  template <class Work>
  auto time(const std::string& stage, Work&& work) {
    const Span span(*this, stage);
    return work();
  }
  /// Runs `work`, whose times are part of the stage's next call: inertial samples between frames.
  template <class Work>
  auto timeTowardsNext(const std::string& stage, Work&& work) {
    const Span span(*this, stage, false);
    return work();
  }
  nlohmann::ordered_json toJson() const;  ///< {"stages": {name: {calls, cpu_ms, wall_ms}}}

 private:
  class Span {
   public:
    Span(StageTimer& timer, const std::string& stage, bool whole = true);
    ~Span();
    Span(const Span&) = delete;
    Span& operator=(const Span&) = delete;

   private:
    StageTimer& timer_;
    std::string stage_;
    bool whole_;
    double cpu_start_ms_, wall_start_ms_;
  };
  struct Samples {
    std::vector<double> cpu_ms, wall_ms;
    double cpu_begun_ms = 0.0, wall_begun_ms = 0.0;
  };
  std::map<std::string, Samples> stages_;
};

}  // namespace perdure::tools
