// Default data of the demo: a rendered drive, and the network in models/ that was trained on such
// drives.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "tools/simulate/simulate.h"

namespace perdure::tools {

/// Options of the default drive: sixty seconds of `street` with its first seed, as JPEG.
SimulateOptions embeddedScene();

/// FOLDER/street-DIGEST. The digest covers the scene, the options and the version.
std::filesystem::path embeddedDriveFolder(const std::filesystem::path& cache);

/// Renders the drive in that folder. Continues an interrupted rendering, and reuses a complete one.
/// Calls `report` after each rendered frame. Throws StartupError if the folder cannot be written.
std::filesystem::path embeddedDrive(const std::filesystem::path& cache,
                                    const std::function<void(const SimulateProgress&)>& report);

/// The only network (.onnx) in ROOT/models/demo or, if there is none, in ROOT/models. Throws
/// StartupError(kUsage) if there is no network or more than one.
std::string embeddedModel(const std::filesystem::path& root);

}  // namespace perdure::tools
