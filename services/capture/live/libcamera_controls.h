// What is asked of a camera by libcamera's controls.
#pragma once

#include <libcamera/controls.h>

#include <string>

#include "services/capture/live/camera_session.h"

namespace perdure::capture {

struct AskedControls {
  libcamera::ControlList list;
  std::string missing;  ///< a sentence of what is configured and not offered; empty where all is
};

/// The rate is asked for where there is a control of it; what comes of it is seen in the frames.
AskedControls controlsFor(const CameraSettings& settings, const libcamera::ControlInfoMap& offered);

}  // namespace perdure::capture
