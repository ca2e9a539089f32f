// Measures CPU and wall time by stage, for timing.json.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/base/quantile.h"

namespace perdure::tools {

/// Measures stages. The time of a nested stage does not count for the outer stage.
class StageTimer {
 public:
  /// Adds CPU time (all threads) and wall time of `work` to `stage` as one call.
  template <class Work>
  auto time(const std::string& stage, Work&& work) {
    const Span span(*this, stage);
    return work();
  }
  /// Runs `work` and adds its times to the next call of the stage. An example is the processing of
  /// inertial samples between frames.
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
    Span* outer_;
    double cpu_start_ms_, wall_start_ms_;
    double cpu_within_ms_ = 0.0, wall_within_ms_ = 0.0;  ///< times of stages in this one
  };
  struct Samples {
    std::vector<double> cpu_ms, wall_ms;
    double cpu_begun_ms = 0.0, wall_begun_ms = 0.0;
  };
  std::map<std::string, Samples> stages_;
  Span* innermost_ = nullptr;
};

}  // namespace perdure::tools
