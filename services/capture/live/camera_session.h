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
  bool id_alone = false;                ///< the id must match one camera only
  std::uint32_t width = 0, height = 0;  ///< pixels, as in the calibration of the rig
  double readout_s = 0.0;               ///< s, from first to last row
  int jpeg_quality = 0;                 ///< 1 … 100: images are sent as JPEG; 0: raw
  std::string encoding = "as_is";       ///< as_is, mono8, bgr8
};

/// An image with the numbering of the driver.
struct CameraShot {
  std::uint32_t sequence = 0;  ///< counted from each opening; lost images leave a gap
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
  /// Settings that the camera does not follow, and why; empty if it follows all.
  virtual std::string note() const = 0;
  /// Whether the camera is unplugged. next() may still return earlier images, and does not wait for
  /// more.
  virtual bool gone() const = 0;
  /// Whether the camera works but must be closed and reopened because of another camera.
  virtual bool stepsAside() const { return false; }
  /// Next image. Empty if none arrives within `longest`, or if the camera is gone.
  virtual std::optional<CameraShot> next(std::chrono::milliseconds longest) = 0;
};

/// Fails with "camera_absent" and the fix. Called only if no session is open.
using OpenCamera = std::function<Result<std::unique_ptr<CameraSession>>()>;

}  // namespace perdure::capture
