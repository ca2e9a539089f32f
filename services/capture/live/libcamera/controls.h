// Controls that are requested from a libcamera camera.
#pragma once

#include <libcamera/camera.h>
#include <libcamera/controls.h>
#include <libcamera/pixel_format.h>

#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "services/capture/live/camera_session.h"
#include "services/capture/live/pixels.h"

namespace perdure::capture {

/// Index in `ids` of the id equal to `wanted`, else of the first id that contains it. With `alone`,
/// only one id may contain it, so that left and right are not exchanged. Fails with "camera_absent"
/// and the fix.
Result<std::size_t> chooseCamera(const std::vector<std::string>& ids, const std::string& wanted,
                                 bool alone);

struct AskedControls {
  libcamera::ControlList list;
  std::string missing;  ///< settings that the camera does not offer; empty if it offers all
  std::string refused;  ///< why the camera must not be used, with the fix; empty if it may be used
};

/// The rate is requested if the camera has a control for it. The frames show the actual rate.
AskedControls controlsFor(const CameraSettings& settings, const libcamera::ControlInfoMap& offered);

using KnownFormat = std::pair<libcamera::PixelFormat, PixelLayout>;
std::span<const KnownFormat> knownFormats();

/// Requests `camera.flip`; validate() removes it if the camera does not support it.
void askFlip(libcamera::CameraConfiguration& configuration, const std::string& flip);
bool flips(const libcamera::CameraConfiguration& configuration, const std::string& flip);
/// Why images do not follow `camera.flip`, with the fix; empty if they do. With "none", images are
/// left as delivered. Those of a camera mounted at 90° stay rotated, and are calibrated in this
/// orientation.
std::string flipRefused(const libcamera::CameraConfiguration& configuration,
                        const std::string& flip);

}  // namespace perdure::capture
