#include "services/capture/live/live.h"

#include <cmath>
#include <numbers>

#include "common/replay/files/rig_file.h"
#include "services/capture/live/libcamera_session.h"

namespace perdure::capture {
namespace {

constexpr const char* kCamera = "cam0";

Calibration rigOf(const Config& config, InstanceId source) {
  requireSource(config);
  Calibration rig = replay::readRig(config.rig);
  rig.source = source;
  std::erase_if(rig.cameras, [](const CameraCalibration& c) { return c.name != kCamera; });
  rig.cameras.front().rate_hz = config.camera.rate_hz;
  rig.has_speed = config.speed.source != "none";
  return rig;
}

CameraSettings cameraSettings(const Config& config, const CameraCalibration& camera) {
  CameraSettings settings;
  settings.id = config.camera.id;
  settings.width = camera.width;
  settings.height = camera.height;
  settings.format = config.camera.format;
  settings.rate_hz = config.camera.rate_hz;
  settings.exposure_ms = config.camera.exposure_ms;
  settings.gain = config.camera.gain;
  settings.focus = config.camera.focus;
  settings.lens_dioptres = config.camera.lens_dioptres;
  settings.flip = config.camera.flip;
  settings.crop = config.camera.crop;
  settings.readout_s = camera.readout_s;
  settings.encoding = config.image.cam0;
  if (config.image.compress == "jpeg")
    settings.jpeg_quality = static_cast<int>(config.image.quality);
  return settings;
}

}  // namespace

Live::Live(service::Context& context, const Config& config)
    : context_(context),
      frames_(context.writer(bus::topics::frame(kCamera))),
      calibrations_(context.writer(bus::topics::kCalibration)),
      imu_(context.sink(bus::topics::kImu)),
      speed_(context.sink(bus::topics::kSpeed)),
      rig_(rigOf(config, context.instance())),
      vehicle_(config.speed, config.gnss,
               {[this](const SpeedReading& reading) { offerOfVehicle(reading); },
                [this](const EarthPlace& place) { offerOfVehicle(place); }}) {
  (void)calibrations_.write(rig_);
  context_.countReasons([this](ReasonCounts& counts) { report(counts); });
  context_.onHealth([this] { updateHealth(); });
  context_.loop().onWake([this] { pump(); });
  if (rig_.imu) openImu(config.imu);
  camera_ = std::make_unique<LiveCamera>(
      libcameraOpener(
          cameraSettings(config, rig_.cameras.front()),
          [this](const std::string& line) { context_.log().warn("libcamera: {}", line); }),
      config.camera.rate_hz, [this](CameraImage image) { offer(Message(std::move(image))); });
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

/// On a stream's thread.
void Live::scanned(const IioScan& scan) {
  const std::lock_guard lock(pairing_mutex_);
  // Of one device both are of one time: the acceleration first, and the pair is complete.
  if (scan.accel) {
    for (const auto& pair : pairing_.accel({scan.time_ns, *scan.accel})) offer(pair);
  }
  if (scan.gyro) {
    ++readings_;
    for (const auto& pair : pairing_.gyro({scan.time_ns, *scan.gyro})) offer(pair);
  }
}

void Live::offer(Message message) {
  if (std::holds_alternative<CameraImage>(message)) context_.health().frameIn();
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
  Frame& frame = image.frame;
  frame.stamp.source = context_.instance();
  frame.stamp.sequence = image.number;
  frame.stamp.time = clock_.at(image.time_ns);
  frame.stamp.captured_ns = std::chrono::steady_clock::now().time_since_epoch().count();
  frame.camera = kCamera;
  if (frames_.write(frame)) context_.health().frameOut();
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
  const std::string note = camera_->state().note();
  std::string problem = camera_->state().problem(), names = camera_->state().name();
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
  const auto add = [&](const ReasonCounts& more) {
    for (const auto& [reason, n] : more.all()) counts.add(reason, n);
  };
  add(reasons_);
  add(camera_->state().reasons());
  vehicle_.report(counts);
  for (const auto& imu : imus_) add(imu->state().reasons());
  const std::lock_guard lock(pairing_mutex_);
  add(pairing_.reasons());
}

}  // namespace perdure::capture
