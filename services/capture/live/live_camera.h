// A camera that is read on its own thread, and reopened after a loss.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "services/capture/live/camera_session.h"
#include "services/capture/live/device_state.h"
#include "services/capture/live/frame_count.h"

namespace perdure::capture {

class LiveCamera {
 public:
  /// Starts the thread, on which both functions are called. `rate_hz`: the requested rate.
  LiveCamera(OpenCamera open, double rate_hz, std::function<void(CameraImage)> give);
  ~LiveCamera();
  LiveCamera(const LiveCamera&) = delete;
  LiveCamera& operator=(const LiveCamera&) = delete;

  /// Returns the state, with the counts "camera_absent" (failed openings), "camera_lost",
  /// "camera_silent" (images stopped), "camera_frame_lost", "camera_frame_error", "camera_reopened"
  /// (because of another camera) and the reasons of packed().
  const DeviceState& state() const { return state_; }

 private:
  void run();
  void flow(CameraSession& session);
  void take(CameraShot shot);

  const OpenCamera open_;
  const std::function<void(CameraImage)> give_;
  FrameNumbers numbers_;
  RateWatch rate_;
  std::atomic<bool> stopping_{false};
  DeviceState state_{"the camera has not been opened yet"};
  std::thread thread_;
};

}  // namespace perdure::capture
