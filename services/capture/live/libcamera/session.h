// Camera sessions through libcamera.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "services/capture/live/camera_session.h"

namespace perdure::capture {

/// Returns one opener for each camera of these settings. `log` receives libcamera's lines, on any
/// thread, during the lifetime of the openers and their sessions. Call it once per process.
std::vector<OpenCamera> libcameraOpeners(const std::vector<CameraSettings>& cameras,
                                         std::function<void(const std::string&)> log);

}  // namespace perdure::capture
