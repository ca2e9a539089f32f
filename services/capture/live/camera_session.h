// A running camera, driven by libcamera or by a test.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/types/sensors.h"
#include "services/capture/config.h"

namespace perdure::capture {

struct CameraSettings : CameraConfig {
  bool id_alone = false;                ///< the id must match exactly one camera
  std::uint32_t width = 0, height = 0;  ///< pixels, as in the rig's calibration
  double readout_s = 0.0;               ///< time from the first to the last row
  int jpeg_quality = 0;                 ///< 1 … 100: quality of JPEG images; 0: raw images
  std::string encoding = "as_is";       ///< as_is, mono8, bgr8
};

/// An image with the driver's number.
struct CameraShot {
  std::uint32_t sequence = 0;  ///< restarts at each opening; lost images leave a gap
  std::int64_t time_ns = 0;    ///< CLOCK_BOOTTIME, middle of the middle row's exposure
  Result<Frame> frame;         ///< pixels only; fails with "camera_frame_error" and the reasons of
                               ///< packed()
};

struct CameraImage {
  std::int64_t time_ns = 0;  ///< CLOCK_BOOTTIME, middle of the middle row's exposure
  std::uint64_t number = 0;  ///< continues over openings; lost images leave a gap
  Frame frame;               ///< pixels, and the camera's name
};

class CameraSession {
 public:
  virtual ~CameraSession() = default;
  virtual std::string name() const = 0;
  /// Returns the settings that the camera does not apply, and why; empty if it applies all.
  virtual std::string note() const = 0;
  /// Returns whether the camera is unplugged. next() may still return earlier images, but then does
  /// not wait for new ones.
  virtual bool gone() const = 0;
  /// Returns whether the camera, although it works, must be closed and reopened because of another
  /// camera.
  virtual bool stepsAside() const { return false; }
  /// Returns the next image. Returns nothing if none arrives within `longest`, or if the camera is
  /// gone.
  virtual std::optional<CameraShot> next(std::chrono::milliseconds longest) = 0;
};

/// Opens a session. Fails with "camera_absent" and the fix. It is called only while no session of
/// this camera is open.
using OpenCamera = std::function<Result<std::unique_ptr<CameraSession>>()>;

}  // namespace perdure::capture
