#include "services/capture/live.h"

#include <cmath>
#include <numbers>

#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"

namespace perdure::capture {
namespace {

std::size_t camerasOf(const Config& config) { return config.camera.second.empty() ? 1 : 2; }

bool isUsed(const CameraCalibration& camera, const Config& config) {
  return camera.name == cameraName(0) || (camera.name == cameraName(1) && camerasOf(config) > 1);
}

/// Reads the calibration of the rig. `unused` receives a sentence if the rig has a camera that is
/// not configured.
Calibration rigOf(const Config& config, InstanceId source, std::string& unused) {
  requireSource(config);
  Calibration rig = replay::readRig(config.rig);
  rig.source = source;
  const auto rest = std::erase_if(rig.cameras, [&](const auto& c) { return !isUsed(c, config); });
  if (rig.cameras.size() < camerasOf(config)) {
    throw StartupError(ExitCode::kConfiguration,
                       "camera.second is given, and " + config.rig +
                           " has no cam1: `perdure calibrate` writes it with both cameras; or "
                           "leave camera.second empty.");
  }
  if (rest > 0) {
    unused = "The rig has cam1, and camera.second names no camera for it: it is not used.";
  }
  for (auto& camera : rig.cameras) camera.rate_hz = config.camera.rate_hz;
  rig.has_speed = config.speed.source != "none";
  return rig;
}

CameraSettings cameraSettings(const Config& config, const CameraCalibration& camera) {
  CameraSettings settings{config.camera};
  const bool second = camera.name == cameraName(1);
  if (second) settings.id = config.camera.second;
  settings.id_alone = camerasOf(config) > 1;
  settings.width = camera.width;
  settings.height = camera.height;
  settings.readout_s = camera.readout_s;
  settings.encoding = second ? config.image.cam1 : config.image.cam0;
  if (config.image.compress == "jpeg")
    settings.jpeg_quality = static_cast<int>(config.image.quality);
  return settings;
}

}  // namespace

Live::Live(service::Context& context, const Config& config, const CameraOpeners& openers)
    : context_(context),
      calibrations_(context.writer(bus::kTopic<Calibration>)),
      imu_(context.sink(bus::kTopic<ImuSample>)),
      speed_(context.sink(bus::kTopic<SpeedSample>)),
      rig_(rigOf(config, context.instance(), unused_)),
      vehicle_(config.speed, config.gnss,
               {[this](const SpeedReading& reading) { offerOfVehicle(reading); },
                [this](const EarthPlace& place) { offerOfVehicle(place); }}) {
  (void)calibrations_.write(rig_);
  context_.countReasons([this](ReasonCounts& counts) { report(counts); });
  context_.onHealth([this] { updateHealth(); });
  context_.loop().onWake([this] { pump(); });
  if (rig_.imu) openImu(config.imu);
  openCameras(config, openers);
}

void Live::openCameras(const Config& config, const CameraOpeners& openers) {
  constexpr std::chrono::milliseconds kLookForDue{2};
  std::vector<CameraSettings> settings;
  for (const CameraCalibration& camera : rig_.cameras) {
    frames_[camera.name] = &context_.writer(bus::frameTopic(camera.name));
    settings.push_back(cameraSettings(config, camera));
  }
  cameras_ = std::make_unique<LiveCameras>(
      openers(settings,
              [this](const std::string& line) { context_.log().warn("libcamera: {}", line); }),
      config.camera.rate_hz, [this](CameraImage image) { offer(Message(std::move(image))); });
  if (settings.size() < 2) return;
  context_.every(kLookForDue, [this] { write(cameras_->due(HostClock::nowNs())); });
}

void Live::openImu(const ImuConfig& config) {
  IioSettings settings;
  settings.uri = config.uri;
  settings.device = config.gyro;
  settings.rate_hz = config.rate_hz;
  settings.trigger = config.trigger;
  settings.mount = config.mount;
  const auto open = [this](const IioSettings& of) {
    imus_.push_back(
        std::make_unique<IioStream>(of, [this](const IioScan& scan) { scanned(scan); }));
  };
  if (config.accel.empty() || config.accel == config.gyro) return open(settings);
  settings.accel = false;
  open(settings);
  settings.device = config.accel;
  settings.accel = true;
  settings.gyro = false;
  open(settings);
}

/// Called on a stream's thread.
void Live::scanned(const IioScan& scan) {
  const std::lock_guard lock(pairing_mutex_);
  // Both readings of a scan have the same time. The acceleration is added first, so that the
  // gyroscope's reading completes the sample.
  if (scan.accel) {
    for (const auto& pair : pairing_.accel({scan.time_ns, *scan.accel})) offer(pair);
  }
  if (scan.gyro) {
    ++readings_;
    for (const auto& pair : pairing_.gyro({scan.time_ns, *scan.gyro})) offer(pair);
  }
}

void Live::offer(Message message) {
  const auto* image = std::get_if<CameraImage>(&message);
  if (image && image->frame.camera == cameraName(0)) context_.health().frameIn();
  queue_.push(std::move(message));
  context_.loop().wake();
}

void Live::offerOfVehicle(Message message) {
  from_vehicle_.push(std::move(message));
  context_.loop().wake();
}

void Live::pump() {
  for (auto* queue : {&queue_, &from_vehicle_}) {
    while (auto message = queue->tryPop()) {
      std::visit([this](auto& m) { publish(std::move(m)); }, *message);
    }
  }
  context_.health().setDropped(queue_.dropped() + from_vehicle_.dropped());
}

void Live::publish(CameraImage image) {
  write(cameras_->pair(std::move(image), HostClock::nowNs()));
}

void Live::write(std::vector<CameraImage> images) {
  for (CameraImage& image : images) {
    Frame& frame = image.frame;
    frame.stamp.source = context_.instance();
    frame.stamp.sequence = image.number;
    frame.stamp.time = clock_.at(image.time_ns);
    frame.stamp.captured_ns = std::chrono::steady_clock::now().time_since_epoch().count();
    const bool written = frames_.at(frame.camera)->write(frame).has_value();
    if (written && frame.camera == cameraName(0)) context_.health().frameOut();
  }
}

void Live::publish(const InertialPair& sample) {
  if (sample.time_ns <= last_ns_) return reasons_.add("imu_out_of_order");
  last_ns_ = sample.time_ns;
  ImuSample out;
  out.source = context_.instance();
  out.sequence = samples_++;
  out.time = clock_.at(sample.time_ns);
  out.gyro = sample.gyro;
  out.accel = sample.accel;
  imu_(out);
}

void Live::publish(const SpeedReading& reading) {
  if (reading.time_ns <= last_speed_ns_) return reasons_.add("speed_out_of_order");
  last_speed_ns_ = reading.time_ns;
  SpeedSample out;
  out.source = context_.instance();
  out.sequence = speeds_++;
  out.time = clock_.at(reading.time_ns);
  out.speed = reading.speed;
  out.sigma = reading.sigma;
  speed_(out);
}

void Live::publish(const EarthPlace& place) {
  rig_.anchor = GeoAnchor{clock_.at(place.time_ns), place.latitude_deg, place.longitude_deg,
                          place.height_m, place.yaw};
  (void)calibrations_.write(rig_);
  context_.log().info("stood at {:.7f}° {:.7f}°, heading {:.1f}° from north, ±{:.2f} m",
                      place.latitude_deg, place.longitude_deg,
                      std::remainder(90.0 - place.yaw * 180.0 / std::numbers::pi, 360.0),
                      place.sigma_m);
}

std::string Live::imuYield() {
  const std::lock_guard lock(pairing_mutex_);
  return yield_.look(readings_, samples_);
}

void Live::updateHealth() {
  const std::string note = joined(cameras_->note(), unused_);
  std::string problem = cameras_->problem(), names = cameras_->name();
  for (const auto& imu : imus_) {
    problem = joined(problem, imu->state().problem());
    names = joined(names, imu->state().name(), "; ");
  }
  problem = joined(joined(problem, imuYield()), vehicle_.problem());
  names = joined(names, vehicle_.name(), "; ");
  if (names != said_ && !names.empty()) context_.log().info("gives {}", names);
  said_ = names;
  if (note != noted_ && !note.empty()) context_.log().warn("{}", note);
  if (!names.empty()) noted_ = note;
  context_.health().state(problem.empty() ? HealthState::kOk : HealthState::kDegraded,
                          joined(problem, note));
}

void Live::report(ReasonCounts& counts) const {
  counts.add(reasons_);
  cameras_->report(counts);
  vehicle_.report(counts);
  for (const auto& imu : imus_) counts.add(imu->state().reasons());
  const std::lock_guard lock(pairing_mutex_);
  counts.add(pairing_.reasons());
}

}  // namespace perdure::capture
