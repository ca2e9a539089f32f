// Cameras of libcamera.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "services/capture/live/camera_session.h"

namespace perdure::capture {

/// Opens the camera of these settings. `log` gets libcamera's lines, on any thread, as long as the
/// result or one of its sessions lives. One for the process.
OpenCamera libcameraOpener(CameraSettings settings, std::function<void(const std::string&)> log);

/// Whether a video node that this process has open is there no more. `descriptors`: links to what
/// is open.
bool openVideoNodeVanished(const std::filesystem::path& descriptors = "/proc/self/fd");

}  // namespace perdure::capture
