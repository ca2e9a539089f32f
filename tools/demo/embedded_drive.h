// Default data of the demo: a rendered drive, and the network in models/ that was trained for it.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "tools/simulate/simulate.h"

namespace perdure::tools {

/// Sixty seconds of `street` with its first seed, as JPEG.
SimulateOptions embeddedScene();

/// FOLDER/street-DIGEST. The digest covers the scene, the options and the version.
std::filesystem::path embeddedDriveFolder(const std::filesystem::path& cache);

/// Renders the drive there. Continues an interrupted rendering, and reuses a complete one. Calls
/// `report` for each rendered frame. Throws StartupError.
std::filesystem::path embeddedDrive(const std::filesystem::path& cache,
                                    const std::function<void(const SimulateProgress&)>& report);

/// The only network (.onnx) in ROOT/models/demo, or else in ROOT/models. Throws
/// StartupError(kUsage) if there is none, or more than one.
std::string embeddedModel(const std::filesystem::path& root);

}  // namespace perdure::tools
