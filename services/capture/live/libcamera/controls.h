// Selects a libcamera camera, and the controls that are requested from it.
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

/// Returns the index in `ids` of the id equal to `wanted`, else of the first id that contains
/// `wanted`. Fails with "camera_absent" and the fix if there is none. If `alone`, also fails if
/// several ids contain `wanted`, so that left and right are not exchanged.
Result<std::size_t> chooseCamera(const std::vector<std::string>& ids, const std::string& wanted,
                                 bool alone);

struct AskedControls {
  libcamera::ControlList list;
  std::string missing;  ///< settings that the camera does not support; empty if none
  std::string refused;  ///< why the camera must not be used, with the fix; or empty
};

/// Returns the controls for these settings, given the controls that the camera offers. A rate is
/// requested only if the camera has a control for it; the frames show the actual rate.
AskedControls controlsFor(const CameraSettings& settings, const libcamera::ControlInfoMap& offered);

using KnownFormat = std::pair<libcamera::PixelFormat, PixelLayout>;
std::span<const KnownFormat> knownFormats();

/// Requests the flip in the configuration. libcamera's validate() removes it if the camera does not
/// support it.
void askFlip(libcamera::CameraConfiguration& configuration, const std::string& flip);
bool flips(const libcamera::CameraConfiguration& configuration, const std::string& flip);
/// Returns why images do not have the requested flip, with the fix; empty if they have it. With
/// "none", images stay as delivered: those of a camera mounted at 90° stay rotated, and are
/// calibrated in this orientation.
std::string flipRefused(const libcamera::CameraConfiguration& configuration,
                        const std::string& flip);

}  // namespace perdure::capture
