// Object scores for report.json: final estimates (objects_final.csv) within 1 m of the ground
// truth, at any orientation. Also copies the ground truth.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "tools/evaluate/object_score.h"

namespace perdure::tools {

/// Returns recall, precision, position_error_m and duplicates, the number of map objects for each
/// true object found (1 is perfect).
nlohmann::ordered_json toReport(const ObjectScore& score);

/// Copies a simulated folder without its images to OUT/truth, which `perdure evaluate` accepts.
/// Scores OUT/objects_final.csv, all classes together, over the frames in `used` (empty: all).
/// Throws StartupError if a part of the folder or of OUT is missing.
nlohmann::ordered_json reportSimulated(const std::filesystem::path& folder,
                                       const std::filesystem::path& out,
                                       const std::optional<std::set<std::uint64_t>>& used = {});

}  // namespace perdure::tools
