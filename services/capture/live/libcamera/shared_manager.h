// The libcamera manager of all cameras. A process may have only one manager at a time.
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

namespace perdure::capture {

/// An object that libcamera still references.
class Unended {
 public:
  virtual ~Unended() = default;
  /// Tries to end the object. It may be destroyed only after this returns true.
  virtual bool over() = 0;
};

class SharedManager {
 public:
  explicit SharedManager(std::function<void(const std::string&)> log,
                         std::filesystem::path devices = "/dev")
      : log_(std::move(log)), devices_(std::move(devices)) {}
  ~SharedManager();
  SharedManager(const SharedManager&) = delete;
  SharedManager& operator=(const SharedManager&) = delete;

  /// Returns a lock with which cameras are opened one after the other. Hold it while calling
  /// manager() or missing().
  std::unique_lock<std::mutex> opening() { return std::unique_lock(mutex_); }
  /// Returns the manager, which exists while one of its cameras is used. Fails if libcamera cannot
  /// start.
  Result<std::shared_ptr<libcamera::CameraManager>> manager();
  /// Reports that the manager lacks a required camera. A new manager replaces it once no camera is
  /// used. The caller must hold one reference to the manager.
  void missing();
  /// Reports that a camera was unplugged. A new manager replaces this one, as with missing().
  /// Otherwise libcamera 0.0.3 enumerates the cameras 2^n times when the nth device is plugged in.
  void unplugged();
  /// Keeps a camera whose removal udev has not reported yet. manager() destroys it later, once
  /// over() returns true. The destructor waits for it for at most two seconds, and then leaks it.
  void keepUntilOver(std::unique_ptr<Unended> camera);
  bool keeps() const;
  /// Returns a number that increases when the open cameras must be closed briefly.
  unsigned restarts() const { return restarts_; }

 private:
  void endKept();

  const LibcameraLog log_;  // destroyed after the manager, whose thread writes to it
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
