// Object scores for report.json: FINAL within 1 m, any orientation, and the copied ground truth.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "tools/evaluate/object_score.h"

namespace perdure::tools {

/// recall, precision, duplicates (map objects for each true object found: 1 is perfect),
/// position_error_m.
nlohmann::ordered_json toReport(const ObjectScore& score);

/// Copies a simulated folder without its images to OUT/truth, which is then valid input for
/// `perdure evaluate`. Scores OUT/objects_final.csv, all classes together, over the frames in
/// `used` (empty: all). Throws StartupError if a part of the folder or of OUT is missing.
nlohmann::ordered_json reportSimulated(const std::filesystem::path& folder,
                                       const std::filesystem::path& out,
                                       const std::optional<std::set<std::uint64_t>>& used = {});

}  // namespace perdure::tools
