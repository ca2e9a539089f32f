#include "services/capture/live/libcamera/session.h"

#include <fmt/format.h>
#include <libcamera/libcamera.h>

#include <algorithm>
#include <map>
#include <utility>

#include "common/vision/jpeg.h"
#include "services/capture/live/clocks.h"
#include "services/capture/live/libcamera/camera_memory.h"
#include "services/capture/live/libcamera/controls.h"
#include "services/capture/live/libcamera/running_camera.h"
#include "services/capture/live/libcamera/shared_manager.h"
#include "services/capture/live/libcamera/video_nodes.h"
#include "services/capture/live/pixels.h"

namespace perdure::capture {
namespace {

using libcamera::FrameBuffer;
using libcamera::Request;
namespace controls = libcamera::controls;

class Session final : public CameraSession {
 public:
  static Result<std::unique_ptr<CameraSession>> open(std::shared_ptr<SharedManager> shared,
                                                     const CameraSettings& settings);
  ~Session() override;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  std::string name() const override {
    return fmt::format("{}, {}x{} {}", id(), stream().size.width, stream().size.height,
                       stream().pixelFormat.toString());
  }
  std::string note() const override {
    return running_->refused()
               ? "The camera refuses what camera.exposure_ms, camera.gain and camera.crop "
                 "ask for; are they in its range?"
               : asked_.missing;
  }
  bool gone() const override { return running_->gone(); }
  bool stepsAside() const override { return shared_->restarts() != opened_at_; }
  std::optional<CameraShot> next(std::chrono::milliseconds longest) override;

 private:
  Session(std::shared_ptr<SharedManager> shared, const CameraSettings& settings)
      : shared_(std::move(shared)), opened_at_(shared_->restarts()), settings_(settings) {}

  const libcamera::StreamConfiguration& stream() const { return configuration_->at(0); }
  const std::string& id() const { return running_->camera().id(); }

  Result<void> choose();
  Result<void> configure();
  void chooseFormat(libcamera::StreamConfiguration& wanted) const;
  Result<void> allocate();
  Result<void> start();
  CameraShot shotOf(Request& request);
  Result<Frame> frameOf(const FrameBuffer& buffer);
  std::int64_t timeOf(Request& request, const libcamera::FrameMetadata& metadata) const;

  const std::shared_ptr<SharedManager> shared_;
  const unsigned opened_at_;
  const CameraSettings settings_;
  std::unique_ptr<RunningCamera> running_;
  std::unique_ptr<libcamera::CameraConfiguration> configuration_;
  PixelLayout layout_ = PixelLayout::kGrey;
  AskedControls asked_;
  std::map<const FrameBuffer*, MappedBuffer> memory_;
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
  if (!running_) return;
  const bool vanished = openVideoNodeVanished() || running_->gone();
  if (!running_->over()) shared_->keepUntilOver(std::move(running_));
  if (vanished) shared_->unplugged();
}

Result<void> Session::choose() {
  auto manager = shared_->manager();
  if (!manager) return tl::unexpected(manager.error());
  const auto there = (*manager)->cameras();
  std::vector<std::string> ids;
  for (const auto& camera : there) ids.push_back(camera->id());
  const auto chosen = chooseCamera(ids, settings_.id, settings_.id_alone);
  if (!chosen) {
    // libcamera never adds a camera that appeared before udev granted access to its nodes.
    shared_->missing();
    return tl::unexpected(chosen.error());
  }
  running_ = std::make_unique<RunningCamera>(*std::move(manager), there[*chosen]);
  if (running_->acquire()) return {};
  return fail("camera_absent",
              shared_->keeps() ? fmt::format("the camera {} was unplugged, and udev has not said "
                                             "so yet.",
                                             id())
                               : fmt::format("the camera {} is in use by another program.", id()));
}

void Session::chooseFormat(libcamera::StreamConfiguration& wanted) const {
  const auto offered = wanted.formats().pixelformats();
  for (const auto& [format, layout] : knownFormats()) {
    const bool named = settings_.format == "auto" || settings_.format == format.toString();
    if (!named || std::ranges::find(offered, format) == offered.end()) continue;
    wanted.pixelFormat = format;
    return;
  }
}

Result<void> Session::configure() {
  configuration_ = running_->camera().generateConfiguration({libcamera::StreamRole::Viewfinder});
  if (!configuration_ || configuration_->empty()) {
    return fail("camera_absent", fmt::format("the camera {} has no stream.", id()));
  }
  auto& wanted = configuration_->at(0);
  chooseFormat(wanted);
  wanted.size = {settings_.width, settings_.height};
  wanted.bufferCount = RunningCamera::kBuffers;
  askFlip(*configuration_, settings_.flip);
  const bool valid = configuration_->validate() != libcamera::CameraConfiguration::Invalid;
  const auto formats = knownFormats();
  const auto known = std::ranges::find_if(
      formats, [&](const auto& entry) { return entry.first == wanted.pixelFormat; });
  const bool sized = wanted.size.width == settings_.width && wanted.size.height == settings_.height;
  if (!valid || known == formats.end() || !sized ||
      running_->camera().configure(configuration_.get()) < 0) {
    return fail("camera_absent",
                "the camera {} gives {} of {}x{} where {} of {}x{} is wanted; set camera.format, "
                "or calibrate it at a size that it has.",
                id(), wanted.pixelFormat.toString(), wanted.size.width, wanted.size.height,
                settings_.format, settings_.width, settings_.height);
  }
  layout_ = known->second;
  const std::string refused = flipRefused(*configuration_, settings_.flip);
  if (refused.empty()) return {};
  return fail("camera_absent", fmt::format("the camera {} {}", id(), refused));
}

Result<void> Session::allocate() {
  libcamera::Stream* stream = configuration_->at(0).stream();
  if (const auto done = running_->allocate(stream); !done) return done;
  for (const auto& buffer : running_->buffers(stream)) {
    memory_.try_emplace(buffer.get(), *buffer);
  }
  return {};
}

Result<void> Session::start() {
  asked_ = controlsFor(settings_, running_->camera().controls());
  if (!asked_.refused.empty()) {
    return fail("camera_absent", fmt::format("the camera {} {}", id(), asked_.refused));
  }
  if (running_->start(asked_.list)) return {};
  return fail("camera_absent", fmt::format("the camera {} does not start.", id()));
}

std::optional<CameraShot> Session::next(std::chrono::milliseconds longest) {
  Request* request = running_->next(longest);
  if (!request) return std::nullopt;
  CameraShot shot = shotOf(*request);
  running_->giveBack(request);
  return shot;
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

/// Returns the time of the image. Without the sensor's own time stamp, the driver's stamp is used,
/// which is later than the exposure.
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

}  // namespace perdure::capture
