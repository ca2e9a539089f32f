// One IIO device's triggered buffer, local or of an iiod in the network: opened, read on a thread
// of its own, and opened again when it was gone.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "services/capture/live/device_state.h"
#include "services/capture/live/imu_pairing.h"

struct iio_buffer;

namespace perdure::capture {

struct IioSettings {
  std::string uri = "local:";
  std::string device = {};   ///< name or id; empty: the first one that has what is wanted
  double rate_hz = 200.0;    ///< asked of the device
  std::string trigger = {};  ///< name or id; empty: as it is
  /// Rows of R in v_B = R v_device; empty: the device's own mount matrix, where it has one.
  std::vector<double> mount = {};
  bool gyro = true, accel = true;  ///< what is wanted of it
};

/// What one scan of the device says.
struct IioScan {
  std::int64_t time_ns = 0;                    ///< CLOCK_BOOTTIME
  std::optional<Eigen::Vector3d> gyro, accel;  ///< rad/s and m/s²
};

class IioStream {
 public:
  /// `give` is called on the stream's thread.
  IioStream(IioSettings settings, std::function<void(const IioScan&)> give);
  ~IioStream();
  IioStream(const IioStream&) = delete;
  IioStream& operator=(const IioStream&) = delete;

  /// Counts "imu_absent" (a try to open it), "imu_lost" (it flowed), "imu_clock_jump".
  const DeviceState& state() const { return state_; }

 private:
  class Device;
  void run();
  void flow(Device& device);

  const IioSettings settings_;
  const std::function<void(const IioScan&)> give_;
  std::atomic<bool> stopping_{false};
  std::mutex mutex_;
  iio_buffer* open_ = nullptr;  ///< to be cancelled when it is to stop
  DeviceState state_{"the IMU has not been opened yet"};
  std::thread thread_;
};

}  // namespace perdure::capture
