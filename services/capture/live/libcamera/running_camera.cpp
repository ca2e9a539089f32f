#include "services/capture/live/libcamera/running_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "services/capture/live/libcamera/video_nodes.h"

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

/// Returns false if the kernel has removed the camera but udev has not reported this. Stopping the
/// camera would then abort the process, because requests were not returned.
bool RunningCamera::end() {
  const bool told = gone_ || !running_;  // no signal if the camera vanished before it ran
  if (!told && openVideoNodeVanished()) return false;
  if (running_) camera_->stop();  // if not running, another program may use it
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
  const std::set<int> before = videoNodesWithBuffers();
  if (requests_.empty() || camera_->start(&asked_) != 0) return false;
  running_ = true;
  const std::set<int> after = videoNodesWithBuffers();
  std::set_difference(after.begin(), after.end(), before.begin(), before.end(),
                      std::back_inserter(nodes_));
  asking_ = requests_.front().get();
  requests_.front()->controls().merge(asked_);
  return std::ranges::all_of(
      requests_, [&](const auto& request) { return camera_->queueRequest(request.get()) == 0; });
}

void RunningCamera::queue(Request* request) {
  request->reuse(Request::ReuseBuffers);
  if (!gone_ && !ending_) camera_->queueRequest(request);
}

/// Receives a completed request on libcamera's thread. If a request is cancelled early, the camera
/// is gone or refuses the controls.
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

/// udev reports a node, not a camera. If the report is late, another camera may already have this
/// node. libcamera then treats that camera as gone, although it still sends images, and the next
/// image would abort the process.
void RunningCamera::disconnected() {
  gone_ = true;
  done_.close();
  for (const int node : nodes_) takeAway(node);
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

/// libcamera completes requests in the order in which they were queued. After a broken image the
/// UVC driver fills the other buffers before that of the broken image. The other images are delayed
/// until that buffer has an image, which is the newest but completes first. All then complete
/// together on libcamera's thread.
void RunningCamera::takeTheRest() {
  invokeMethod(&RunningCamera::settle, libcamera::ConnectionTypeBlocking);
  while (const auto more = done_.tryPop()) in_hand_.push_back(*more);
  std::ranges::sort(in_hand_, [](const Request* a, const Request* b) {
    return isEarlier(sequenceOf(*a), sequenceOf(*b));
  });
}

}  // namespace perdure::capture
