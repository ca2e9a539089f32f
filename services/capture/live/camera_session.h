// A camera that runs, whoever drives it: libcamera, or a test.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::capture {

struct CameraSettings {
  std::string id;                       ///< of libcamera, or a part of it; empty: the first one
  bool id_alone = false;                ///< no other camera may have it in its id
  std::uint32_t width = 0, height = 0;  ///< pixels, as the rig was calibrated for
  std::string format = "auto";          ///< libcamera's name, as "YUYV"; auto: the best it has
  double rate_hz = 20.0;
  double exposure_ms = 0.0, gain = 0.0;  ///< 0: automatic
  std::string focus = "as_is";           ///< as_is, auto, manual: at lens_dioptres
  double lens_dioptres = 0.0;            ///< 1/m; 0: far away
  std::string flip = "none";             ///< none, horizontal, vertical, both
  std::vector<double> crop = {};         ///< x, y, width, height, pixels of the sensor; empty: all
  double readout_s = 0.0;                ///< first to last row
  int jpeg_quality = 0;                  ///< 1 … 100: images travel as JPEG; 0: raw
  std::string encoding = "as_is";        ///< as_is, mono8, bgr8
};

/// An image as the driver counts it.
struct CameraShot {
  std::uint32_t sequence = 0;  ///< from each opening on; what the driver lost leaves a gap
  std::int64_t time_ns = 0;    ///< CLOCK_BOOTTIME, middle of the middle row's exposure
  Result<Frame> frame;         ///< pixels alone; "camera_frame_error" and the reasons of packed()
};

/// An image as it is given on.
struct CameraImage {
  std::int64_t time_ns = 0;  ///< CLOCK_BOOTTIME, middle of the middle row's exposure
  std::uint64_t number = 0;  ///< goes on over openings; frames that were lost leave a gap
  Frame frame;               ///< pixels, and the camera's name
};

class CameraSession {
 public:
  virtual ~CameraSession() = default;
  /// For people.
  virtual std::string name() const = 0;
  /// What it does not do as asked, and why; empty where it does.
  virtual std::string note() const = 0;
  /// Unplugged; next() may still have images of before, and does not wait for more.
  virtual bool gone() const = 0;
  /// It is well, and is to be closed and opened again for the sake of another camera.
  virtual bool stepsAside() const { return false; }
  /// The next one; nothing where none came within so long, or it is gone.
  virtual std::optional<CameraShot> next(std::chrono::milliseconds longest) = 0;
};

/// Reasons: "camera_absent"; the detail is a sentence with the mend. Called when no session is.
using OpenCamera = std::function<Result<std::unique_ptr<CameraSession>>()>;

}  // namespace perdure::capture
