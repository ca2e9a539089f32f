// One live camera, or two whose images are paired, with what Health says of them.
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

/// Each camera has a thread of its own; all of this is for one other thread, which hands over the
/// images that they give.
class LiveCameras {
 public:
  /// One or two: cam0, cam1. `give` is called on their threads, with the camera's name in the
  /// frame.
  LiveCameras(const std::vector<OpenCamera>& cameras, double rate_hz,
              const std::function<void(CameraImage)>& give);

  /// What goes out now that this one has been given; with two cameras, pairs. CLOCK_BOOTTIME.
  std::vector<CameraImage> pair(CameraImage image, std::int64_t now_ns);
  /// What has waited long enough for a partner.
  std::vector<CameraImage> due(std::int64_t now_ns);

  /// As DeviceState; of two cameras with the name of the one that it is of.
  std::string problem() const;
  std::string name() const;
  std::string note() const;
  /// Of two cameras the counts end in the camera's name.
  void report(ReasonCounts& counts) const;

 private:
  std::string named(std::size_t i, const std::string& text, const char* between) const;

  std::optional<StereoPairing> pairing_;
  std::list<LiveCamera> cameras_;
};

/// "cam0", "cam1".
std::string cameraName(std::size_t i);

}  // namespace perdure::capture
