// One live camera, or two with paired images, and their status for Health.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "services/capture/live/cameras/stereo_pairing.h"
#include "services/capture/live/live_camera.h"

namespace perdure::capture {

/// Each camera has its own thread. All members are called from one other thread, which passes on
/// the cameras' images.
class LiveCameras {
 public:
  /// One or two cameras: cam0, cam1. `give` is called on their threads, with the camera's name in
  /// the frame.
  LiveCameras(const std::vector<OpenCamera>& cameras, double rate_hz,
              const std::function<void(CameraImage)>& give);

  /// Takes an image and returns the images to publish. `now_ns`: CLOCK_BOOTTIME.
  std::vector<CameraImage> pair(CameraImage image, std::int64_t now_ns);
  /// Returns images whose wait for a partner has ended.
  std::vector<CameraImage> due(std::int64_t now_ns);

  /// As in DeviceState; with two cameras, each text begins with the camera's name.
  std::string problem() const;
  std::string name() const;
  std::string note() const;
  /// With two cameras, the names of counts end in the camera's name.
  void report(ReasonCounts& counts) const;

 private:
  std::string named(std::size_t i, const std::string& text, const char* between) const;

  std::optional<StereoPairing> pairing_;
  std::list<LiveCamera> cameras_;
};

std::string cameraName(std::size_t i);

}  // namespace perdure::capture
