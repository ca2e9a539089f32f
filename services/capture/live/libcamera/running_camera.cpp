#include "services/capture/live/libcamera/running_camera.h"

#include <fmt/format.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>
#include <utility>

#include "services/capture/live/libcamera/last_of_all.h"

namespace perdure::capture {
namespace {

using libcamera::Request;

std::uint32_t sequenceOf(const Request& request) {
  return request.buffers().begin()->second->metadata().sequence;
}

}  // namespace

RunningCamera::RunningCamera(std::shared_ptr<libcamera::CameraManager> manager,
                             std::shared_ptr<libcamera::Camera> camera)
    : manager_(std::move(manager)), camera_(std::move(camera)), home_(thread()) {
  moveToThread(camera_->thread());
}

bool RunningCamera::over() { return lastOfAll(*this, &RunningCamera::leave, &RunningCamera::end); }

/// Stopping a camera that the kernel alone knows to be gone would end the process, over requests
/// that are not given back.
bool RunningCamera::end() {
  const bool told = gone_ || !running_;  // who was gone before it ran is not told here
  if (!told && openVideoNodeVanished()) return false;
  if (running_) camera_->stop();  // else it may be another one's
  camera_->requestCompleted.disconnect(this);
  camera_->disconnected.disconnect(this);
  requests_.clear();
  allocator_.reset();
  if (acquired_) camera_->release();
  moveToThread(home_);
  return true;
}

bool RunningCamera::acquire() {
  acquired_ = camera_->acquire() == 0;
  return acquired_;
}

Result<void> RunningCamera::allocate(libcamera::Stream* stream) {
  allocator_ = std::make_unique<libcamera::FrameBufferAllocator>(camera_);
  if (allocator_->allocate(stream) < 0) {
    return fail("camera_absent", fmt::format("no memory for images of {}.", camera_->id()));
  }
  for (const auto& buffer : allocator_->buffers(stream)) {
    auto request = camera_->createRequest();
    if (!request || request->addBuffer(stream, buffer.get()) < 0) {
      return fail("camera_absent", fmt::format("{} takes no requests.", camera_->id()));
    }
    requests_.push_back(std::move(request));
  }
  return {};
}

bool RunningCamera::start(const libcamera::ControlList& asked) {
  asked_ = asked;
  return invokeMethod(&RunningCamera::begin, libcamera::ConnectionTypeBlocking);
}

bool RunningCamera::begin() {
  camera_->requestCompleted.connect(this, &RunningCamera::completed);
  camera_->disconnected.connect(this, &RunningCamera::disconnected);
  if (requests_.empty() || camera_->start(&asked_) != 0) return false;
  running_ = true;
  asking_ = requests_.front().get();
  requests_.front()->controls().merge(asked_);
  return std::all_of(requests_.begin(), requests_.end(), [&](const auto& request) {
    return camera_->queueRequest(request.get()) == 0;
  });
}

void RunningCamera::queue(Request* request) {
  request->reuse(Request::ReuseBuffers);
  if (!gone_ && !ending_) camera_->queueRequest(request);
}

/// No work here. A request that is cancelled before the end found the camera gone, or controls that
/// it refuses.
void RunningCamera::completed(Request* request) {
  const bool asked = request == asking_;
  if (asked) asking_ = nullptr;
  if (request->status() != Request::RequestCancelled) {
    done_.push(request);
  } else if (asked && !ending_) {
    refused_ = true;
    queue(request);
  }
}

void RunningCamera::disconnected() {
  gone_ = true;
  done_.close();
}

Request* RunningCamera::next(std::chrono::milliseconds longest) {
  if (in_hand_.empty()) {
    const auto request = done_.popWithin(longest);
    if (!request) return nullptr;
    in_hand_ = {*request};
    if (watch_.skips(sequenceOf(**request))) takeTheRest();
  }
  Request* first = in_hand_.front();
  in_hand_.pop_front();
  watch_.seen(sequenceOf(*first));
  return first;
}

void RunningCamera::giveBack(Request* request) {
  invokeMethod(&RunningCamera::queue, libcamera::ConnectionTypeQueued, request);
}

/// libcamera completes requests in the order in which they were queued. The driver of UVC uses the
/// buffer of a broken image again, behind the others: their images are held back until that one has
/// its own, which is the newest and comes first. All of them come in one go on libcamera's thread.
void RunningCamera::takeTheRest() {
  invokeMethod(&RunningCamera::settle, libcamera::ConnectionTypeBlocking);
  while (const auto more = done_.tryPop()) in_hand_.push_back(*more);
  std::sort(in_hand_.begin(), in_hand_.end(), [](const Request* a, const Request* b) {
    return isEarlier(sequenceOf(*a), sequenceOf(*b));
  });
}

bool openVideoNodeVanished(const std::filesystem::path& descriptors) {
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(descriptors, none)) {
    const std::string target = std::filesystem::read_symlink(entry.path(), none).string();
    if (!target.starts_with("/dev/video")) continue;
    v4l2_capability unused{};
    const int node = std::atoi(entry.path().filename().c_str());
    if (target.ends_with(" (deleted)")) return true;
    if (ioctl(node, VIDIOC_QUERYCAP, &unused) != 0 && errno == ENODEV) return true;
  }
  return false;
}

}  // namespace perdure::capture
