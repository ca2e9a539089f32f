// Compares the map with the parked cars of the drive, if labels exist.
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

/// Takes --truth and --truth-sequence. For a KITTI drive that is also a tracking sequence, it
/// otherwise searches a folder kitti_tracking near the data. Empty if there are no labels. Throws
/// StartupError if --truth was given and has none.
std::optional<TruthFiles> findTruth(const DemoOptions& options);

/// Copies labels and calibration to OUT/truth and compares the tables of OUT with them: recall,
/// precision, duplicates, position error (FINAL, 1 m), and each parked car.
nlohmann::ordered_json scoreAgainst(const TruthFiles& truth, const std::filesystem::path& out);

}  // namespace perdure::tools
