#include "services/capture/live/libcamera/shared_manager.h"

#include <fmt/format.h>

#include <cstring>

namespace perdure::capture {

Result<std::shared_ptr<libcamera::CameraManager>> SharedManager::manager() {
  if (manager_.use_count() == 1 && stale_.exchange(false)) manager_.reset();
  if (manager_) return manager_;
  auto manager = std::make_shared<libcamera::CameraManager>();
  stale_ = false;
  unplugged_ = 0;
  rule_.started(readableVideoNodes(devices_));
  if (const int code = manager->start(); code < 0) {
    return fail("camera_absent",
                fmt::format("libcamera does not start: {}.", std::strerror(-code)));
  }
  manager_ = std::move(manager);
  return manager_;
}

void SharedManager::missing() {
  constexpr long kOurs = 2;  // this one and the caller's
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
