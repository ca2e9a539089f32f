// The checks of a recording that pipeline, demo and doctor make before anything runs.
#pragma once

#include <nlohmann/json.hpp>

#include "common/replay/data_check.h"
#include "common/replay/files/pose_file.h"

namespace perdure::tools {

/// Those of common/replay, and where images and samples are used whether they turn alike. Images
/// are only looked at where `use.images`; takes some tenths of a second.
replay::DataFindings checkDrive(const replay::Recording& recording, const replay::DataUse& use);

/// Whether poses that are given turn and accelerate as the IMU says; and whether the images turn
/// with them, where `use.images` or where there is no IMU.
replay::DataFindings checkPoses(const replay::Recording& recording, const replay::PoseFile& file,
                                const replay::DataUse& use);

/// A list of {grade, code, text}.
nlohmann::ordered_json toJson(const replay::DataFindings& findings);

/// The recording's notes and what is doubtful, a line each, on standard error.
void printDoubts(const replay::Recording& recording, const replay::DataFindings& findings);

}  // namespace perdure::tools
