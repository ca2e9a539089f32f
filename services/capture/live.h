// Publishes live sensors: cameras, IMU, speed, and the calibration of the rig.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <variant>
#include <vector>

#include "common/base/bounded_queue.h"
#include "common/service/service.h"
#include "services/capture/config.h"
#include "services/capture/live/cameras/live_cameras.h"
#include "services/capture/live/clocks.h"
#include "services/capture/live/iio_stream.h"
#include "services/capture/live/imu_pairing.h"
#include "services/capture/vehicle/vehicle.h"

namespace perdure::capture {

/// Returns the functions that open the cameras of these settings. `log` receives the log lines of
/// the cameras.
using CameraOpeners = std::function<std::vector<OpenCamera>(
    const std::vector<CameraSettings>& cameras, std::function<void(const std::string&)> log)>;

class Live {
 public:
  /// Reads the rig file and publishes its calibration. Opens the sensors in the background, and
  /// reopens them after a loss. Throws StartupError if the rig file is not configured, cannot be
  /// read, or lacks a configured camera.
  Live(service::Context& context, const Config& config, const CameraOpeners& openers);

 private:
  using Message = std::variant<CameraImage, InertialPair, SpeedReading, EarthPlace>;

  void openCameras(const Config& config, const CameraOpeners& openers);
  void openImu(const ImuConfig& config);
  void scanned(const IioScan& scan);
  void offer(Message message);
  void offerOfVehicle(Message message);
  void pump();
  void publish(CameraImage image);
  void write(std::vector<CameraImage> images);
  void publish(const InertialPair& sample);
  void publish(const SpeedReading& reading);
  /// Publishes the calibration again, together with the position of the body on Earth.
  void publish(const EarthPlace& place);
  void updateHealth();
  std::string imuYield();
  void report(ReasonCounts& counts) const;

  service::Context& context_;
  const HostClock clock_;
  std::map<std::string, bus::Writer<Frame>*> frames_;  ///< writers, by camera
  bus::Writer<Calibration>& calibrations_;
  Sink<ImuSample> imu_;
  Sink<SpeedSample> speed_;
  std::string unused_;  ///< cameras of the rig that the configuration does not use
  Calibration rig_;
  BoundedQueue<Message> queue_{1024, Overflow::kDropOldest};  // several seconds of IMU samples
  /// A separate queue, so that too many messages from the network cause no loss of images.
  BoundedQueue<Message> from_vehicle_{256, Overflow::kDropOldest};
  std::uint64_t samples_ = 0;
  std::int64_t last_ns_ = 0;  ///< stamp of the last inertial sample
  std::uint64_t speeds_ = 0;
  std::int64_t last_speed_ns_ = 0;
  ReasonCounts reasons_;
  std::string said_;   ///< names of the sensors, as last logged
  std::string noted_;  ///< settings that the cameras do not follow, as last logged
  ImuYield yield_;
  mutable std::mutex pairing_mutex_;
  ImuPairing pairing_;
  std::uint64_t readings_ = 0;  ///< number of gyroscope readings
  // The threads of these members use all members above, so these members are destroyed first.
  std::vector<std::unique_ptr<IioStream>> imus_;
  std::unique_ptr<LiveCameras> cameras_;
  Vehicle vehicle_;
};

}  // namespace perdure::capture
