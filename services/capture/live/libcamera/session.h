// Cameras of libcamera.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "services/capture/live/camera_session.h"

namespace perdure::capture {

/// Opens the cameras of these settings, one opener for each. `log` gets libcamera's lines, on any
/// thread, as long as one of the results or of their sessions lives. Once for the process.
std::vector<OpenCamera> libcameraOpeners(const std::vector<CameraSettings>& cameras,
                                         std::function<void(const std::string&)> log);

}  // namespace perdure::capture
