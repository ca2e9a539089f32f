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

/// Each camera has its own thread. One other thread receives the cameras' images and calls all
/// members of this class.
class LiveCameras {
 public:
  /// Opens one camera (cam0) or two (cam0, cam1). `give` is called on their threads; the frame has
  /// the camera's name.
  LiveCameras(const std::vector<OpenCamera>& cameras, double rate_hz,
              const std::function<void(CameraImage)>& give);

  /// Takes an image, and returns the images that can now be published. `now_ns`: CLOCK_BOOTTIME.
  std::vector<CameraImage> pair(CameraImage image, std::int64_t now_ns);
  /// Returns the images that have waited too long for a partner, for publication.
  std::vector<CameraImage> due(std::int64_t now_ns);

  /// Return the texts of DeviceState. With two cameras, each text begins with the camera's name.
  std::string problem() const;
  std::string name() const;
  std::string note() const;
  /// Adds the counts. With two cameras, the names of the counts end in the camera's name.
  void report(ReasonCounts& counts) const;

 private:
  std::string named(std::size_t i, const std::string& text, const char* between) const;

  std::optional<StereoPairing> pairing_;
  std::list<LiveCamera> cameras_;
};

std::string cameraName(std::size_t i);

}  // namespace perdure::capture
