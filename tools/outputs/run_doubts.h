// Problems of a run that ended normally. They are printed as warnings and stored in report.json.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/replay/data_check.h"

namespace perdure::tools {

struct Doubt {
  std::string what;  ///< short text for the last line
  std::string fix;   ///< causes and fixes
};
using Doubts = std::vector<Doubt>;

struct RunFacts {
  /// Reasons counted by vio; if poses are given, by the node that computes landmarks.
  ReasonCounts vio = {};
  std::uint64_t frames = 0;  ///< frames of the first camera
  ReasonCounts capture = {};
  std::optional<std::uint64_t> poses = {};  ///< number of frames with a pose; nothing: not counted
  std::uint64_t without_pose = 0;           ///< frames without a given pose
  std::uint64_t boxes = 0, objects = 0;
  replay::DataFindings findings = {};  ///< findings before the run
};

/// Number of images that are missing or unreadable, or whose line in the dataset is unusable.
std::uint64_t imagesLost(const ReasonCounts& capture);

/// Finds problems: frames without a visual update, an empty map, changed clocks, contradictions.
Doubts doubtsOfRun(const RunFacts& facts);

/// Returns " | WARNING: …" with each `what`; "" if there are no doubts.
std::string endOfLine(const Doubts& doubts);
void printWarnings(const Doubts& doubts);
nlohmann::ordered_json toJson(const Doubts& doubts);

}  // namespace perdure::tools
