// Checks of a recording that pipeline, demo and doctor run before they process it.
#pragma once

#include <nlohmann/json.hpp>

#include "common/replay/data_check.h"
#include "common/replay/files/pose_file.h"

namespace perdure::tools {

/// Runs the checks of common/replay. Compares the rotations of images and IMU if `use` contains
/// both. Images are read only if `use.images` is set; this takes some tenths of a second.
replay::DataFindings checkDrive(const replay::Recording& recording, const replay::DataUse& use);

/// Checks whether given poses rotate and accelerate as the IMU measured. Compares them with the
/// image rotation too if `use.images` is set or if there is no IMU.
replay::DataFindings checkPoses(const replay::Recording& recording, const replay::PoseFile& file,
                                const replay::DataUse& use);

/// Whether later checks and vio would only show the consequences of a finding.
inline bool isCause(const replay::DataFinding& finding) {
  return finding.grade == replay::DataFinding::Grade::kCause;
}

/// A list of {grade, code, text}.
nlohmann::ordered_json toJson(const replay::DataFindings& findings);

/// Prints the recording's notes and doubtful findings on standard error, one per line.
void printDoubts(const replay::Recording& recording, const replay::DataFindings& findings);

}  // namespace perdure::tools
