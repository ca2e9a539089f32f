// What report.json says of objects: FINAL under 1 m, any orientation, and the truth beside it.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "tools/evaluate/object_score.h"

namespace perdure::tools {

/// recall, precision, duplicates (objects of the map for each true one that was found: 1 is
/// perfect), position_error_m.
nlohmann::ordered_json toReport(const ObjectScore& score);

/// Copies all of the simulated folder but its images to OUT/truth, which is then a simulated folder
/// for `perdure evaluate`, and scores OUT/objects_final.csv, all classes together, over the
/// frames that were `used` (nothing: all). Throws StartupError where the folder or OUT lacks a
/// part.
nlohmann::ordered_json reportSimulated(const std::filesystem::path& folder,
                                       const std::filesystem::path& out,
                                       const std::optional<std::set<std::uint64_t>>& used = {});

}  // namespace perdure::tools
