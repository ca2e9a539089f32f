// What is asked of a camera by libcamera's controls.
#pragma once

#include <libcamera/camera.h>
#include <libcamera/controls.h>
#include <libcamera/pixel_format.h>

#include <span>
#include <string>
#include <utility>

#include "services/capture/live/camera_session.h"
#include "services/capture/live/pixels.h"

namespace perdure::capture {

struct AskedControls {
  libcamera::ControlList list;
  std::string missing;  ///< a sentence of what is configured and not offered; empty where all is
  std::string refused;  ///< why it is not to be used at all, with the mend; empty where it may be
};

/// The rate is asked for where there is a control of it; what comes of it is seen in the frames.
AskedControls controlsFor(const CameraSettings& settings, const libcamera::ControlInfoMap& offered);

using KnownFormat = std::pair<libcamera::PixelFormat, PixelLayout>;
/// The best first.
std::span<const KnownFormat> knownFormats();

/// Asks for `camera.flip`; validate() takes back what the camera cannot do.
void askFlip(libcamera::CameraConfiguration& configuration, const std::string& flip);
/// Whether it is still asked for.
bool flips(const libcamera::CameraConfiguration& configuration, const std::string& flip);
/// Why its images are not as `camera.flip` says, with the mend; empty where they are. With none
/// they are as they come: of a camera that is mounted at 90° they stay turned, and so they are
/// calibrated.
std::string flipRefused(const libcamera::CameraConfiguration& configuration,
                        const std::string& flip);

}  // namespace perdure::capture
