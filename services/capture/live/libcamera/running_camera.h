// A camera of libcamera that was taken, and its requests.
#pragma once

#include <libcamera/libcamera.h>

#include <atomic>
#include <chrono>
#include <deque>
#include <memory>
#include <vector>

#include "common/base/bounded_queue.h"
#include "common/base/result.h"
#include "services/capture/live/frame_count.h"
#include "services/capture/live/libcamera/unended.h"

namespace perdure::capture {

/// libcamera's thread calls slots and looks at requests by bare pointers, and a call of
/// queueRequest() only reaches it some time later. So all that touches requests and signals is done
/// on that thread: nothing can be unplugged in between, and once it is over() that thread knows of
/// none of them.
class RunningCamera final : public Unended, public libcamera::Object {
 public:
  static constexpr std::size_t kBuffers = 4;

  RunningCamera(std::shared_ptr<libcamera::CameraManager> manager,
                std::shared_ptr<libcamera::Camera> camera);
  RunningCamera(const RunningCamera&) = delete;
  RunningCamera& operator=(const RunningCamera&) = delete;

  libcamera::Camera& camera() { return *camera_; }
  /// False where another program has it, or libcamera thinks that we still do.
  bool acquire();
  /// "camera_absent". A request for each buffer of a stream that is configured.
  Result<void> allocate(libcamera::Stream* stream);
  const std::vector<std::unique_ptr<libcamera::FrameBuffer>>& buffers(libcamera::Stream* s) const {
    return allocator_->buffers(s);
  }
  /// Some pipelines take controls as they start, that of UVC takes them from requests alone.
  bool start(const libcamera::ControlList& asked);

  /// Unplugged, as libcamera was told by udev.
  bool gone() const { return gone_; }
  /// It does not take the controls that it was started with.
  bool refused() const { return refused_; }
  /// The next one in the driver's order, whose image is there until it is given back.
  libcamera::Request* next(std::chrono::milliseconds longest);
  void giveBack(libcamera::Request* request);

  /// False where the kernel has removed the camera and udev has not told libcamera of that yet.
  bool over() override;

 private:
  void takeTheRest();

  // On libcamera's thread:
  bool begin();
  void queue(libcamera::Request* request);
  void settle() {}
  void completed(libcamera::Request* request);
  void disconnected();
  void leave() { ending_ = true; }
  bool end();

  const std::shared_ptr<libcamera::CameraManager> manager_;  // goes after its camera
  const std::shared_ptr<libcamera::Camera> camera_;
  libcamera::Thread* const home_;
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  std::vector<std::unique_ptr<libcamera::Request>> requests_;
  std::vector<int> nodes_;  ///< descriptors of its own video nodes, which libcamera opened
  libcamera::ControlList asked_;
  const libcamera::Request* asking_ = nullptr;  ///< carries the controls, until it is back
  BoundedQueue<libcamera::Request*> done_{2 * kBuffers, Overflow::kDropOldest};  // never full
  std::deque<libcamera::Request*> in_hand_;  ///< taken out of done_, in the driver's order
  SequenceWatch watch_;
  std::atomic<bool> gone_{false}, refused_{false};
  bool acquired_ = false, running_ = false, ending_ = false;
};

}  // namespace perdure::capture
