// A camera through libcamera: set up, read on a thread of its own, and opened again when it was
// gone.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

#include "common/types/sensors.h"
#include "services/capture/live/device_state.h"

namespace perdure::capture {

struct CameraSettings {
  std::string id;                       ///< of libcamera, or a part of it; empty: the first one
  std::uint32_t width = 0, height = 0;  ///< pixels, as the rig was calibrated for
  std::string format = "auto";          ///< libcamera's name, as "YUYV"; auto: the best it has
  double rate_hz = 20.0;
  double exposure_ms = 0.0, gain = 0.0;  ///< 0: automatic
  double readout_s = 0.0;                ///< first to last row
  int jpeg_quality = 0;                  ///< 1 … 100: images travel as JPEG; 0: raw
  std::string encoding = "as_is";        ///< as_is, mono8, bgr8
};

struct CameraImage {
  std::int64_t time_ns = 0;  ///< CLOCK_BOOTTIME, middle of the middle row's exposure
  std::uint64_t number = 0;  ///< frames that were lost on the way leave a gap
  Frame frame;               ///< pixels alone
};

/// Middle of the middle row's exposure. `start_ns`: when that of the first row began.
std::int64_t middleOfExposure(std::int64_t start_ns, std::int64_t exposure_us, double readout_s);

class LiveCamera {
 public:
  /// `give` is called on the camera's thread.
  LiveCamera(CameraSettings settings, std::function<void(CameraImage)> give);
  ~LiveCamera();
  LiveCamera(const LiveCamera&) = delete;
  LiveCamera& operator=(const LiveCamera&) = delete;

  /// Counts "camera_absent" (a try to open it), "camera_lost", "camera_silent" (it flowed),
  /// "camera_frame_lost", "camera_frame_error", and the reasons of packed().
  const DeviceState& state() const { return state_; }

 private:
  class Session;
  void run();
  void flow(Session& session);

  const CameraSettings settings_;
  const std::function<void(CameraImage)> give_;
  std::atomic<bool> stopping_{false};
  DeviceState state_{"the camera has not been opened yet"};
  std::thread thread_;
};

}  // namespace perdure::capture
