// An acquired libcamera camera and its requests.
#pragma once

#include <libcamera/base/object.h>
#include <libcamera/libcamera.h>

#include <atomic>
#include <chrono>
#include <deque>
#include <memory>
#include <vector>

#include "common/base/bounded_queue.h"
#include "common/base/result.h"
#include "services/capture/live/frame_count.h"
#include "services/capture/live/libcamera/shared_manager.h"

namespace perdure::capture {

/// Calls `leave` and then `end` on the object's thread, and returns the result of `end`. Messages
/// that wait on that thread, and those that they post (queueRequest()), are processed before `end`,
/// because libcamera would otherwise process them later with raw pointers. After `leave`, the
/// object must not post.
template <class T, class Answer>
Answer lastOfAll(T& object, void (T::*leave)(), Answer (T::*end)()) {
  object.invokeMethod(leave, libcamera::ConnectionTypeBlocking);
  return object.invokeMethod(end, libcamera::ConnectionTypeBlocking);
}

/// libcamera's thread calls slots and reads requests through raw pointers. Therefore all access to
/// requests and signals is on that thread: no camera can be unplugged during an access, and after
/// over() the thread has no pointers to this object.
class RunningCamera final : public Unended, public libcamera::Object {
 public:
  static constexpr std::size_t kBuffers = 4;

  RunningCamera(std::shared_ptr<libcamera::CameraManager> manager,
                std::shared_ptr<libcamera::Camera> camera);
  RunningCamera(const RunningCamera&) = delete;
  RunningCamera& operator=(const RunningCamera&) = delete;

  libcamera::Camera& camera() { return *camera_; }
  /// Acquires the camera. Returns false if another program, or libcamera in this process, still
  /// uses it.
  bool acquire();
  /// Allocates a request for each buffer of a configured stream. Fails with "camera_absent".
  Result<void> allocate(libcamera::Stream* stream);
  const std::vector<std::unique_ptr<libcamera::FrameBuffer>>& buffers(libcamera::Stream* s) const {
    return allocator_->buffers(s);
  }
  /// Starts the camera with these controls. Some pipelines apply controls at the start, but the UVC
  /// pipeline only with a request. Returns false on failure.
  bool start(const libcamera::ControlList& asked);

  /// Returns whether udev has reported to libcamera that the camera is unplugged.
  bool gone() const { return gone_; }
  /// Returns whether the camera refuses the controls given at its start.
  bool refused() const { return refused_; }
  /// Returns the next request in the driver's order, or nullptr if none completes within `longest`.
  /// Its image is valid until giveBack().
  libcamera::Request* next(std::chrono::milliseconds longest);
  void giveBack(libcamera::Request* request);

  /// Returns false if the kernel has removed the camera but udev has not yet reported this to
  /// libcamera.
  bool over() override;

 private:
  void takeTheRest();

  // Members that run on libcamera's thread:
  bool begin();
  void queue(libcamera::Request* request);
  void settle() {}
  void completed(libcamera::Request* request);
  void disconnected();
  void leave() { ending_ = true; }
  bool end();

  const std::shared_ptr<libcamera::CameraManager> manager_;  // destroyed after its camera
  const std::shared_ptr<libcamera::Camera> camera_;
  libcamera::Thread* const home_;
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  std::vector<std::unique_ptr<libcamera::Request>> requests_;
  std::vector<int> nodes_;  ///< descriptors of the camera's video nodes, which libcamera opened
  libcamera::ControlList asked_;
  /// The request that contains the controls, until it is completed.
  const libcamera::Request* asking_ = nullptr;
  BoundedQueue<libcamera::Request*> done_{2 * kBuffers, Overflow::kDropOldest};  // never full
  std::deque<libcamera::Request*> in_hand_;  ///< taken from done_, in the driver's order
  SequenceWatch watch_;
  std::atomic<bool> gone_{false}, refused_{false};
  bool acquired_ = false, running_ = false, ending_ = false;
};

}  // namespace perdure::capture
