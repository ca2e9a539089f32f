// What is known of the drive's parked cars: compared with the map, where labels are at hand.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "tools/demo/plan.h"

namespace perdure::tools {

struct TruthFiles {
  std::filesystem::path labels, calibration;
  std::string sequence;
};

/// --truth and --truth-sequence, or, for a KITTI drive that is a tracking sequence, a folder
/// kitti_tracking near the data. Nothing where there are no labels. Throws StartupError where
/// --truth was given and lacks them.
std::optional<TruthFiles> findTruth(const DemoOptions& options);

/// Copies labels and calibration to OUT/truth and compares OUT's tables with them: recall,
/// precision, duplicates, position error (FINAL, 1 m), and the parked cars one by one.
nlohmann::ordered_json scoreAgainst(const TruthFiles& truth, const std::filesystem::path& out);

}  // namespace perdure::tools
