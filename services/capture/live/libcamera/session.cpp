#include "services/capture/live/libcamera/session.h"

#include <fmt/format.h>
#include <libcamera/libcamera.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <thread>
#include <utility>

#include "common/base/bounded_queue.h"
#include "common/vision/jpeg.h"
#include "services/capture/live/clocks.h"
#include "services/capture/live/frame_count.h"
#include "services/capture/live/libcamera/camera_choice.h"
#include "services/capture/live/libcamera/camera_memory.h"
#include "services/capture/live/libcamera/controls.h"
#include "services/capture/live/libcamera/last_of_all.h"
#include "services/capture/live/libcamera/shared_manager.h"
#include "services/capture/live/pixels.h"

namespace perdure::capture {
namespace {

using libcamera::FrameBuffer;
using libcamera::Request;
namespace controls = libcamera::controls;

constexpr std::size_t kBuffers = 4;

std::uint32_t sequenceOf(const Request& request) {
  return request.buffers().begin()->second->metadata().sequence;
}

/// libcamera's thread calls slots and looks at requests by bare pointers, and a call of
/// queueRequest() only reaches it some time later. So all that touches requests and signals is done
/// on that thread: nothing can be unplugged in between, and after end() it knows of none of them.
class Session final : public CameraSession, public libcamera::Object {
 public:
  static Result<std::unique_ptr<CameraSession>> open(std::shared_ptr<SharedManager> shared,
                                                     const CameraSettings& settings);
  ~Session() override;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  std::string name() const override {
    return fmt::format("{}, {}x{} {}", camera_->id(), stream().size.width, stream().size.height,
                       stream().pixelFormat.toString());
  }
  std::string note() const override {
    return refused_ ? "The camera refuses what camera.exposure_ms, camera.gain and camera.crop "
                      "ask for; are they in its range?"
                    : asked_.missing;
  }
  bool gone() const override { return gone_; }
  bool stepsAside() const override { return shared_->restarts() != opened_at_; }
  std::optional<CameraShot> next(std::chrono::milliseconds longest) override;

 private:
  Session(std::shared_ptr<SharedManager> shared, const CameraSettings& settings)
      : shared_(std::move(shared)), opened_at_(shared_->restarts()), settings_(settings) {}

  const libcamera::StreamConfiguration& stream() const { return configuration_->at(0); }

  Result<void> choose();
  Result<void> configure();
  void chooseFormat(libcamera::StreamConfiguration& wanted) const;
  Result<void> allocate();
  Result<void> start();
  Request* nextRequest(std::chrono::milliseconds longest);
  void takeTheRest();
  CameraShot shotOf(Request& request);
  Result<Frame> frameOf(const FrameBuffer& buffer);
  std::int64_t timeOf(Request& request, const libcamera::FrameMetadata& metadata) const;

  // On libcamera's thread:
  bool begin();
  void queue(Request* request);
  void settle() {}
  void completed(Request* request);
  void disconnected();
  void leave() { ending_ = true; }
  bool end();

  const std::shared_ptr<SharedManager> shared_;
  const unsigned opened_at_;
  std::shared_ptr<libcamera::CameraManager> manager_;  // goes after its camera
  const CameraSettings settings_;
  std::shared_ptr<libcamera::Camera> camera_;
  std::unique_ptr<libcamera::CameraConfiguration> configuration_;
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  PixelLayout layout_ = PixelLayout::kGrey;
  AskedControls asked_;
  std::vector<std::unique_ptr<Request>> requests_;
  std::map<const FrameBuffer*, MappedBuffer> memory_;
  BoundedQueue<Request*> done_{2 * kBuffers, Overflow::kDropOldest};  // never full: kBuffers exist
  std::deque<Request*> in_hand_;  ///< taken out of done_, in the driver's order
  SequenceWatch watch_;
  std::atomic<bool> gone_{false}, refused_{false};
  bool acquired_ = false, running_ = false, ending_ = false;
  int tries_to_end_ = 0;
  libcamera::Thread* home_ = nullptr;
  const Request* asking_ = nullptr;  ///< the one that carries the controls, until it is back
};

Result<std::unique_ptr<CameraSession>> Session::open(std::shared_ptr<SharedManager> shared,
                                                     const CameraSettings& settings) {
  const auto one_by_one = shared->opening();
  auto session = std::unique_ptr<Session>(new Session(shared, settings));
  for (const auto& step :
       {&Session::choose, &Session::configure, &Session::allocate, &Session::start}) {
    if (const auto done = (session.get()->*step)(); !done) return tl::unexpected(done.error());
  }
  return session;
}

Session::~Session() {
  if (!camera_) return;
  const bool vanished = openVideoNodeVanished();
  while (!lastOfAll(*this, &Session::leave, &Session::end)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  if (gone_ || vanished) shared_->unplugged();
}

/// False where the kernel has removed the camera and libcamera does not know that yet: stopping it
/// would end the process, over requests that are not given back. udev tells it sooner or later.
bool Session::end() {
  constexpr int kMostTries = 600;
  const bool told = gone_ || !running_;  // who was gone before it ran is not told here
  if (!told && ++tries_to_end_ < kMostTries && openVideoNodeVanished()) return false;
  camera_->stop();
  camera_->requestCompleted.disconnect(this);
  camera_->disconnected.disconnect(this);
  requests_.clear();
  allocator_.reset();
  if (acquired_) camera_->release();
  moveToThread(home_);
  return true;
}

Result<void> Session::choose() {
  auto manager = shared_->manager();
  if (!manager) return tl::unexpected(manager.error());
  manager_ = *std::move(manager);
  const auto there = manager_->cameras();
  std::vector<std::string> ids;
  for (const auto& camera : there) ids.push_back(camera->id());
  const auto chosen = chooseCamera(ids, settings_.id, settings_.id_alone);
  if (!chosen) {
    // One that came before udev had let this user have its nodes is left out by libcamera for good.
    shared_->missing();
    return tl::unexpected(chosen.error());
  }
  camera_ = there[*chosen];
  home_ = thread();
  moveToThread(camera_->thread());
  acquired_ = camera_->acquire() == 0;
  if (acquired_) return {};
  return fail("camera_absent",
              fmt::format("the camera {} is in use by another program.", camera_->id()));
}

void Session::chooseFormat(libcamera::StreamConfiguration& wanted) const {
  const auto offered = wanted.formats().pixelformats();
  for (const auto& [format, layout] : knownFormats()) {
    const bool named = settings_.format == "auto" || settings_.format == format.toString();
    if (!named || std::find(offered.begin(), offered.end(), format) == offered.end()) continue;
    wanted.pixelFormat = format;
    return;
  }
}

Result<void> Session::configure() {
  configuration_ = camera_->generateConfiguration({libcamera::StreamRole::Viewfinder});
  if (!configuration_ || configuration_->empty()) {
    return fail("camera_absent", fmt::format("the camera {} has no stream.", camera_->id()));
  }
  auto& wanted = configuration_->at(0);
  chooseFormat(wanted);
  wanted.size = {settings_.width, settings_.height};
  wanted.bufferCount = kBuffers;
  const libcamera::Transform turned = transformOf(settings_.flip);
  configuration_->transform = turned;
  const bool valid = configuration_->validate() != libcamera::CameraConfiguration::Invalid;
  const auto formats = knownFormats();
  const auto known = std::find_if(formats.begin(), formats.end(), [&](const auto& entry) {
    return entry.first == wanted.pixelFormat;
  });
  const bool sized = wanted.size.width == settings_.width && wanted.size.height == settings_.height;
  if (!valid || known == formats.end() || !sized || camera_->configure(configuration_.get()) < 0) {
    return fail(
        "camera_absent",
        fmt::format("the camera {} gives {} of {}x{} where {} of {}x{} is wanted; set "
                    "camera.format, or calibrate it at a size that it has.",
                    camera_->id(), wanted.pixelFormat.toString(), wanted.size.width,
                    wanted.size.height, settings_.format, settings_.width, settings_.height));
  }
  layout_ = known->second;
  if (configuration_->transform != turned) {
    return fail("camera_absent",
                fmt::format("the camera {} cannot mirror its images; set camera.flip to none, and "
                            "calibrate it as it is mounted.",
                            camera_->id()));
  }
  return {};
}

Result<void> Session::allocate() {
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

Result<void> Session::start() {
  asked_ = controlsFor(settings_, camera_->controls());
  if (!asked_.refused.empty()) {
    return fail("camera_absent", fmt::format("the camera {} {}", camera_->id(), asked_.refused));
  }
  if (invokeMethod(&Session::begin, libcamera::ConnectionTypeBlocking)) return {};
  return fail("camera_absent", fmt::format("the camera {} does not start.", camera_->id()));
}

/// Some pipelines take controls as they start, that of UVC takes them from requests alone.
bool Session::begin() {
  camera_->requestCompleted.connect(this, &Session::completed);
  camera_->disconnected.connect(this, &Session::disconnected);
  if (requests_.empty() || camera_->start(&asked_.list) != 0) return false;
  running_ = true;
  asking_ = requests_.front().get();
  requests_.front()->controls().merge(asked_.list);
  return std::all_of(requests_.begin(), requests_.end(), [&](const auto& request) {
    return camera_->queueRequest(request.get()) == 0;
  });
}

void Session::queue(Request* request) {
  request->reuse(Request::ReuseBuffers);
  if (!gone_ && !ending_) camera_->queueRequest(request);
}

/// No work here. A request that is cancelled before the end found the camera gone, or controls that
/// it refuses.
void Session::completed(Request* request) {
  const bool asked = request == asking_;
  if (asked) asking_ = nullptr;
  if (request->status() != Request::RequestCancelled) {
    done_.push(request);
  } else if (asked && !ending_) {
    refused_ = true;
    queue(request);
  }
}

void Session::disconnected() {
  gone_ = true;
  done_.close();
}

std::optional<CameraShot> Session::next(std::chrono::milliseconds longest) {
  Request* request = nextRequest(longest);
  if (!request) return std::nullopt;
  CameraShot shot = shotOf(*request);
  watch_.seen(shot.sequence);
  invokeMethod(&Session::queue, libcamera::ConnectionTypeQueued, request);
  return shot;
}

Request* Session::nextRequest(std::chrono::milliseconds longest) {
  if (in_hand_.empty()) {
    const auto request = done_.popWithin(longest);
    if (!request) return nullptr;
    in_hand_ = {*request};
    if (watch_.skips(sequenceOf(**request))) takeTheRest();
  }
  Request* first = in_hand_.front();
  in_hand_.pop_front();
  return first;
}

/// libcamera completes requests in the order in which they were queued. The driver of UVC uses the
/// buffer of a broken image again, behind the others: their images are held back until that one has
/// its own, which is the newest and comes first. All of them come in one go on libcamera's thread.
void Session::takeTheRest() {
  invokeMethod(&Session::settle, libcamera::ConnectionTypeBlocking);
  while (const auto more = done_.tryPop()) in_hand_.push_back(*more);
  std::sort(in_hand_.begin(), in_hand_.end(), [](const Request* a, const Request* b) {
    return isEarlier(sequenceOf(*a), sequenceOf(*b));
  });
}

CameraShot Session::shotOf(Request& request) {
  const FrameBuffer& buffer = *request.buffers().begin()->second;
  const auto& metadata = buffer.metadata();
  return {metadata.sequence, timeOf(request, metadata), frameOf(buffer)};
}

Result<Frame> Session::frameOf(const FrameBuffer& buffer) {
  const auto& metadata = buffer.metadata();
  if (metadata.status != libcamera::FrameMetadata::FrameSuccess) return fail("camera_frame_error");
  const MappedBuffer& memory = memory_.at(&buffer);
  memory.sync(true);
  auto frame = packed(layout_, stream().size.width, stream().size.height,
                      imagePlanes(stream(), layout_, memory, metadata), settings_.encoding);
  memory.sync(false);
  if (!frame || settings_.jpeg_quality == 0) return frame;
  return vision::compressed(*frame, settings_.jpeg_quality);
}

/// Without the sensor's own time: when the driver had the image, which was exposed before that.
std::int64_t Session::timeOf(Request& request, const libcamera::FrameMetadata& metadata) const {
  const auto exposure_us = request.metadata().get(controls::ExposureTime).value_or(0);
  const auto start = request.metadata().get(controls::SensorTimestamp);
  const std::int64_t begun = start ? *start
                                   : static_cast<std::int64_t>(metadata.timestamp) -
                                         1000 * std::int64_t{exposure_us} -
                                         static_cast<std::int64_t>(1e9 * settings_.readout_s);
  const std::int64_t now = HostClock::monotonicNs();
  const std::int64_t boot = cameraStampToBoot(begun, now, now + HostClock::monotonicToBootNs());
  return middleOfExposure(boot, exposure_us, settings_.readout_s);
}

}  // namespace

std::vector<OpenCamera> libcameraOpeners(const std::vector<CameraSettings>& cameras,
                                         std::function<void(const std::string&)> log) {
  const auto shared = std::make_shared<SharedManager>(std::move(log));
  std::vector<OpenCamera> openers;
  for (const CameraSettings& settings : cameras) {
    openers.push_back([shared, settings] { return Session::open(shared, settings); });
  }
  return openers;
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
