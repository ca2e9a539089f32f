#include "services/capture/live/libcamera/shared_manager.h"

#include <fmt/format.h>

#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

namespace perdure::capture {

/// Leaks the cameras that have not ended within kLongest, because libcamera still references them.
SharedManager::~SharedManager() {
  constexpr std::chrono::milliseconds kLongest{2000}, kPause{50};
  for (auto left = kLongest; keeps() && left.count() > 0; left -= kPause) {
    endKept();
    if (keeps()) std::this_thread::sleep_for(kPause);
  }
  for (auto& camera : kept_) (void)camera.release();
}

void SharedManager::keepUntilOver(std::unique_ptr<Unended> camera) {
  const std::lock_guard lock(kept_mutex_);
  kept_.push_back(std::move(camera));
}

bool SharedManager::keeps() const {
  const std::lock_guard lock(kept_mutex_);
  return !kept_.empty();
}

void SharedManager::endKept() {
  const std::lock_guard lock(kept_mutex_);
  std::erase_if(kept_, [](const auto& camera) { return camera->over(); });
}

Result<std::shared_ptr<libcamera::CameraManager>> SharedManager::manager() {
  endKept();
  if (manager_.use_count() == 1 && stale_.exchange(false)) manager_.reset();
  if (manager_) return manager_;
  auto manager = std::make_shared<libcamera::CameraManager>();
  stale_ = false;
  unplugged_ = 0;
  rule_.started(readableVideoNodes(devices_));
  if (const int code = manager->start(); code < 0) {
    return fail("camera_absent", "libcamera does not start: {}.", std::strerror(-code));
  }
  manager_ = std::move(manager);
  return manager_;
}

void SharedManager::missing() {
  constexpr long kOurs = 2;  // references of this object and of the caller
  stale_ = true;
  if (manager_.use_count() <= kOurs) return;
  for (unsigned n = unplugged_.exchange(0); n > 0; --n) rule_.unplugged();
  if (rule_.missed(readableVideoNodes(devices_))) ++restarts_;
}

void SharedManager::unplugged() {
  ++unplugged_;
  stale_ = true;
}

}  // namespace perdure::capture
