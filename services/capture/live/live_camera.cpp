#include "services/capture/live/live_camera.h"

#include <fmt/format.h>
#include <libcamera/libcamera.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <utility>

#include "common/base/bounded_queue.h"
#include "common/vision/jpeg.h"
#include "services/capture/live/camera_memory.h"
#include "services/capture/live/clocks.h"
#include "services/capture/live/pixels.h"

namespace perdure::capture {
namespace {

using libcamera::CameraManager;
using libcamera::FrameBuffer;
using libcamera::PixelFormat;
using libcamera::Request;
namespace formats = libcamera::formats;
namespace controls = libcamera::controls;

constexpr std::size_t kBuffers = 4;
constexpr std::chrono::milliseconds kSilence{1000};

/// The best first: the least to convert, and all the colour there is. libcamera names the bytes of
/// a pixel from the last one in memory on.
const std::array<std::pair<PixelFormat, PixelLayout>, 11> kFormats = {{
    {formats::RGB888, PixelLayout::kBgr},
    {formats::BGR888, PixelLayout::kRgb},
    {formats::XRGB8888, PixelLayout::kBgrx},
    {formats::XBGR8888, PixelLayout::kRgbx},
    {formats::NV12, PixelLayout::kNv12},
    {formats::NV21, PixelLayout::kNv21},
    {formats::YUV420, PixelLayout::kYuv420},
    {formats::YUYV, PixelLayout::kYuyv},
    {formats::UYVY, PixelLayout::kUyvy},
    {formats::MJPEG, PixelLayout::kJpeg},
    {formats::R8, PixelLayout::kGrey},
}};

/// One for the process, for as long as it lives: that is libcamera's rule.
Result<CameraManager*> manager() {
  static CameraManager instance;
  static const int code = [] {
    libcamera::logSetLevel("*", "ERROR");
    return instance.start();
  }();
  if (code < 0) {
    return fail("camera_absent",
                fmt::format("libcamera does not start: {}.", std::strerror(-code)));
  }
  return &instance;
}

}  // namespace

std::int64_t middleOfExposure(std::int64_t start_ns, std::int64_t exposure_us, double readout_s) {
  return start_ns + 500 * exposure_us + static_cast<std::int64_t>(0.5e9 * readout_s);
}

/// A camera that runs.
class LiveCamera::Session {
 public:
  /// Reasons: "camera_absent"; the detail is a sentence with the mend.
  static Result<std::unique_ptr<Session>> open(const CameraSettings& settings) {
    auto session = std::unique_ptr<Session>(new Session(settings));
    for (const auto& step :
         {&Session::choose, &Session::configure, &Session::allocate, &Session::start}) {
      if (const auto done = (session.get()->*step)(); !done) return tl::unexpected(done.error());
    }
    return session;
  }

  ~Session() {
    if (!camera_) return;
    if (running_) camera_->stop();
    camera_->requestCompleted.disconnect(this);
    camera_->disconnected.disconnect(this);
    done_.close();
    requests_.clear();
    memory_.clear();
    allocator_.reset();
    if (acquired_) camera_->release();
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  bool gone() const { return gone_; }
  std::string name() const {
    return fmt::format("{}, {}x{} {}", camera_->id(), stream().size.width, stream().size.height,
                       stream().pixelFormat.toString());
  }
  /// What it cannot do as asked; empty where it can.
  const std::string& shortcoming() const { return shortcoming_; }

  /// The next image; an error with its reason, "camera_silent" where none comes.
  Result<CameraImage> next() {
    const auto request = done_.popWithin(kSilence);
    if (!request) return fail(gone_ ? "camera_lost" : "camera_silent");
    auto image = imageOf(**request);
    (*request)->reuse(Request::ReuseBuffers);
    if (camera_->queueRequest(*request) < 0) gone_ = true;
    return image;
  }

 private:
  explicit Session(const CameraSettings& settings) : settings_(settings) {}

  const libcamera::StreamConfiguration& stream() const { return configuration_->at(0); }

  Result<void> choose() {
    const auto cameras = manager();
    if (!cameras) return tl::unexpected(cameras.error());
    std::string there;
    for (const auto& camera : (*cameras)->cameras()) {
      there += (there.empty() ? "" : ", ") + camera->id();
      if (!camera_ && camera->id().find(settings_.id) != std::string::npos) camera_ = camera;
    }
    if (!camera_) {
      return fail(
          "camera_absent",
          fmt::format("libcamera sees no camera{} (there are: {}); is it plugged in, and may "
                      "this user read /dev/video* and /dev/media*?",
                      settings_.id.empty() ? "" : " with " + settings_.id + " in its id",
                      there.empty() ? "none" : there));
    }
    acquired_ = camera_->acquire() == 0;
    if (acquired_) return {};
    return fail("camera_absent",
                fmt::format("the camera {} is in use by another program.", camera_->id()));
  }

  Result<void> configure() {
    configuration_ = camera_->generateConfiguration({libcamera::StreamRole::Viewfinder});
    if (!configuration_ || configuration_->empty()) {
      return fail("camera_absent", fmt::format("the camera {} has no stream.", camera_->id()));
    }
    auto& wanted = configuration_->at(0);
    const auto offered = wanted.formats().pixelformats();
    for (const auto& [format, layout] : kFormats) {
      const bool named = settings_.format == "auto" || settings_.format == format.toString();
      if (!named || std::find(offered.begin(), offered.end(), format) == offered.end()) continue;
      wanted.pixelFormat = format;
      break;
    }
    wanted.size = {settings_.width, settings_.height};
    wanted.bufferCount = kBuffers;
    const bool valid = configuration_->validate() != libcamera::CameraConfiguration::Invalid;
    const auto known = std::find_if(kFormats.begin(), kFormats.end(), [&](const auto& entry) {
      return entry.first == wanted.pixelFormat;
    });
    const bool sized =
        wanted.size.width == settings_.width && wanted.size.height == settings_.height;
    if (!valid || known == kFormats.end() || !sized ||
        camera_->configure(configuration_.get()) < 0) {
      return fail(
          "camera_absent",
          fmt::format("the camera {} gives {} of {}x{} where {} of {}x{} is wanted; set "
                      "camera.format, or calibrate it at a size that it has.",
                      camera_->id(), wanted.pixelFormat.toString(), wanted.size.width,
                      wanted.size.height, settings_.format, settings_.width, settings_.height));
    }
    layout_ = known->second;
    return {};
  }

  Result<void> allocate() {
    libcamera::Stream* stream = configuration_->at(0).stream();
    allocator_ = std::make_unique<libcamera::FrameBufferAllocator>(camera_);
    if (allocator_->allocate(stream) < 0) {
      return fail("camera_absent", fmt::format("no memory for images of {}.", camera_->id()));
    }
    for (const auto& buffer : allocator_->buffers(stream)) {
      auto request = camera_->createRequest();
      if (!request || request->addBuffer(stream, buffer.get()) < 0) {
        return fail("camera_absent", fmt::format("{} takes no requests.", camera_->id()));
      }
      memory_.try_emplace(buffer.get(), *buffer);
      requests_.push_back(std::move(request));
    }
    return {};
  }

  /// What the camera has no control for is said, and goes without.
  template <class T, class V>
  void set(libcamera::ControlList& list, const libcamera::Control<T>& control, const V& value) {
    if (camera_->controls().find(control.id()) == camera_->controls().end()) {
      shortcoming_ += (shortcoming_.empty() ? "the camera has no " : ", ") + control.name();
    } else {
      list.set(control, value);
    }
  }

  Result<void> start() {
    camera_->requestCompleted.connect(this, &Session::completed);
    camera_->disconnected.connect(this, &Session::disconnected);
    libcamera::ControlList list(controls::controls);
    const auto duration_us = static_cast<std::int64_t>(1e6 / settings_.rate_hz);
    const std::array<std::int64_t, 2> limits = {duration_us, duration_us};
    set(list, controls::FrameDurationLimits, libcamera::Span<const std::int64_t, 2>(limits));
    if (settings_.exposure_ms > 0.0) {
      set(list, controls::AeEnable, false);
      set(list, controls::ExposureTime, static_cast<std::int32_t>(1e3 * settings_.exposure_ms));
    }
    if (settings_.gain > 0.0) {
      set(list, controls::AnalogueGain, static_cast<float>(settings_.gain));
    }
    if (!shortcoming_.empty()) shortcoming_ += ": it keeps its own.";
    running_ = camera_->start(&list) == 0;
    for (const auto& request : requests_) {
      running_ = running_ && camera_->queueRequest(request.get()) == 0;
    }
    if (running_) return {};
    return fail("camera_absent", fmt::format("the camera {} does not start.", camera_->id()));
  }

  /// On libcamera's thread: no work here.
  void completed(Request* request) {
    if (request->status() != Request::RequestCancelled) done_.push(request);
  }
  void disconnected() { gone_ = true; }

  Result<CameraImage> imageOf(Request& request) {
    const FrameBuffer& buffer = *request.buffers().begin()->second;
    const auto& metadata = buffer.metadata();
    if (metadata.status != libcamera::FrameMetadata::FrameSuccess) {
      return fail("camera_frame_error");
    }
    const MappedBuffer& memory = memory_.at(&buffer);
    memory.sync(true);
    auto frame = packed(layout_, stream().size.width, stream().size.height,
                        imagePlanes(stream(), layout_, memory, metadata), settings_.encoding);
    memory.sync(false);
    if (frame && settings_.jpeg_quality > 0) {
      frame = vision::compressed(*frame, settings_.jpeg_quality);
    }
    if (!frame) return tl::unexpected(frame.error());
    const auto exposure = request.metadata().get(controls::ExposureTime);
    const auto start = request.metadata().get(controls::SensorTimestamp);
    // Without the sensor's own time: when the driver had the image, which was exposed before that.
    const std::int64_t begun = start ? *start
                                     : static_cast<std::int64_t>(metadata.timestamp) -
                                           1000 * exposure.value_or(0) -
                                           static_cast<std::int64_t>(1e9 * settings_.readout_s);
    CameraImage image;
    image.time_ns = middleOfExposure(begun, exposure.value_or(0), settings_.readout_s);
    image.number = number(request.sequence());
    image.frame = std::move(*frame);
    return image;
  }

  /// The driver counts 32 bits.
  std::uint64_t number(std::uint32_t sequence) {
    number_ += static_cast<std::uint32_t>(sequence - last_);
    last_ = sequence;
    return number_;
  }

  const CameraSettings settings_;
  std::shared_ptr<libcamera::Camera> camera_;
  std::unique_ptr<libcamera::CameraConfiguration> configuration_;
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  PixelLayout layout_ = PixelLayout::kGrey;
  std::vector<std::unique_ptr<Request>> requests_;
  std::map<const FrameBuffer*, MappedBuffer> memory_;
  BoundedQueue<Request*> done_{2 * kBuffers, Overflow::kDropOldest};  // never full: kBuffers exist
  std::string shortcoming_;
  std::uint64_t number_ = 0;
  std::uint32_t last_ = 0;
  std::atomic<bool> gone_{false};
  bool acquired_ = false, running_ = false;
};

LiveCamera::LiveCamera(CameraSettings settings, std::function<void(CameraImage)> give)
    : settings_(std::move(settings)), give_(std::move(give)), thread_([this] { run(); }) {}

LiveCamera::~LiveCamera() {
  stopping_ = true;
  thread_.join();
}

void LiveCamera::run() {
  keepOpen(stopping_, [this] {
    if (auto session = Session::open(settings_)) {
      flow(**session);
    } else {
      state_.fails(session.error());
    }
  });
}

void LiveCamera::flow(Session& session) {
  std::optional<std::uint64_t> last;
  while (!stopping_ && !session.gone()) {
    auto image = session.next();
    if (!image && image.error().code == "camera_silent") {
      return state_.fails({"camera_silent", "the camera " + session.name() +
                                                " gives no images; it is opened again. Is its "
                                                "cable loose?"});
    }
    state_.flows(session.name(), session.shortcoming());
    if (!image) {
      state_.count(image.error().code);
      continue;
    }
    if (last && image->number > *last + 1) {
      state_.count("camera_frame_lost", image->number - *last - 1);
    }
    last = image->number;
    give_(*std::move(image));
  }
  if (!stopping_) {
    state_.fails({"camera_lost", "the camera was unplugged; plug it in again, and it goes on."});
  }
}

}  // namespace perdure::capture
