// libcamera's manager, of which a process has one at a time, for all of its cameras.
#pragma once

#include <libcamera/camera_manager.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "services/capture/live/libcamera/log.h"
#include "services/capture/live/libcamera/restart_rule.h"
#include "services/capture/live/libcamera/unended.h"

namespace perdure::capture {

class SharedManager {
 public:
  /// `devices`: where the video nodes are.
  explicit SharedManager(std::function<void(const std::string&)> log,
                         std::filesystem::path devices = "/dev")
      : log_(std::move(log)), devices_(std::move(devices)) {}
  ~SharedManager();
  SharedManager(const SharedManager&) = delete;
  SharedManager& operator=(const SharedManager&) = delete;

  /// Cameras are opened one after the other. Held while one calls manager() or missing().
  std::unique_lock<std::mutex> opening() { return std::unique_lock(mutex_); }
  /// Kept as long as one of its cameras is used.
  Result<std::shared_ptr<libcamera::CameraManager>> manager();
  /// It does not have a camera that is looked for: the next one is another one, as soon as nobody
  /// uses this one. Called by one user.
  void missing();
  /// The same: a camera was unplugged. libcamera 0.0.3 looks for cameras twice as often at each
  /// device that is plugged in, 2^n times at the nth.
  void unplugged();
  /// A camera of which udev has not told yet that it is gone: it goes with a later manager(), when
  /// it is over; at the end of this, within two seconds or never.
  void keepUntilOver(std::unique_ptr<Unended> camera);
  /// Whether there is one.
  bool keeps() const;
  /// Grows where the cameras that were opened before are to be closed for a moment.
  unsigned restarts() const { return restarts_; }

 private:
  void endKept();

  const LibcameraLog log_;  // goes after the manager, whose thread writes to it
  const std::filesystem::path devices_;
  std::mutex mutex_;
  std::shared_ptr<libcamera::CameraManager> manager_;
  std::atomic<bool> stale_{false};
  std::atomic<unsigned> unplugged_{0}, restarts_{0};
  RestartRule rule_;
  mutable std::mutex kept_mutex_;
  std::vector<std::unique_ptr<Unended>> kept_;
};

}  // namespace perdure::capture
