// What the demo takes where it is given nothing: a drive that it renders, and the network in
// models/ that was trained for such drives.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "tools/simulate/simulate.h"

namespace perdure::tools {

/// Sixty seconds of `street` with its first seed, JPEG.
SimulateOptions embeddedScene();

/// FOLDER/street-DIGEST: the digest is of the scene, the options and the version: of
/// all that the frames depend on but the renderer's code.
std::filesystem::path embeddedDriveFolder(const std::filesystem::path& cache);

/// Renders the drive there, or carries on where an earlier run was cut; takes it as it is where it
/// is complete. `report` is called for each frame that is drawn. Throws StartupError.
std::filesystem::path embeddedDrive(const std::filesystem::path& cache,
                                    const std::function<void(const SimulateProgress&)>& report);

/// The one network (.onnx) in ROOT/models/demo, or else in ROOT/models. Throws StartupError(kUsage)
/// with the mend where there is none, or more than one.
std::string embeddedModel(const std::filesystem::path& root);

}  // namespace perdure::tools
