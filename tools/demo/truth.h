// Compares the map with the labelled parked cars of a drive.
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

/// Returns the files of --truth and --truth-sequence. Without them, for a KITTI drive that is also
/// a tracking sequence, searches a folder kitti_tracking near the data. Empty if there are no
/// labels. Throws StartupError if --truth was given and contains no labels.
std::optional<TruthFiles> findTruth(const DemoOptions& options);

/// Copies labels and calibration to OUT/truth, and scores the tables of OUT: recall, precision,
/// duplicates, position error (final estimates, matches within 1 m), and each parked car.
nlohmann::ordered_json scoreAgainst(const TruthFiles& truth, const std::filesystem::path& out);

/// Writes the true path and the true objects of a simulated drive, in the world's frame. Returns
/// false, without a file, if the drive lacks a part of the truth. Throws like writeChecked().
bool writeTruthForPage(const std::filesystem::path& drive, const std::filesystem::path& file);

}  // namespace perdure::tools
