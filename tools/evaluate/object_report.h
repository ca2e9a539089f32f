// What report.json says of objects: FINAL under 1 m, any orientation, and the truth beside it.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tools/evaluate/object_score.h"

namespace perdure::tools {

/// recall, precision, duplicates (objects of the map for each true one that was found: 1 is
/// perfect), position_error_m.
nlohmann::ordered_json toReport(const ObjectScore& score);

/// Copies all of the simulated folder but its images to OUT/truth, which is then a simulated folder
/// for `perdure evaluate`, and scores OUT/objects_final.csv, all classes together, from
/// `first_frame` on. Throws StartupError where the folder or OUT lacks a part.
nlohmann::ordered_json reportSimulated(const std::filesystem::path& folder,
                                       const std::filesystem::path& out,
                                       std::uint64_t first_frame = 0);

}  // namespace perdure::tools
