// Reads the triggered buffer of one IIO device, local or of an iiod in the network. A separate
// thread reads the buffer, and reopens the device after a loss.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "services/capture/live/device_state.h"
#include "services/capture/live/imu_pairing.h"

struct iio_buffer;

namespace perdure::capture {

/// Removes surrounding white space; sysfs files end in a newline.
std::string trimmed(std::string_view text);

/// The clock of a device's stamps. kElsewhere: a clock that this host cannot read.
enum class StampClock { kBoot, kMonotonic, kRealtime, kElsewhere };

StampClock stampClockNamed(std::string_view text);

/// Parses a mount matrix, "1, 0, 0; 0, 1, 0; 0, 0, 1", row by row. Returns nothing if the text is
/// not such a matrix.
std::optional<Eigen::Matrix3d> parseMount(std::string text);

struct IioSettings {
  std::string uri = "local:";
  std::string device = {};   ///< name or id; empty: the first device with the required channels
  double rate_hz = 200.0;    ///< requested rate
  std::string trigger = {};  ///< name or id; empty: unchanged
  /// Rows of R in v_B = R v_device. If empty, the device's own mount matrix applies, if it has one.
  std::vector<double> mount = {};
  bool gyro = true, accel = true;  ///< required channels
};

struct IioScan {
  std::int64_t time_ns = 0;                    ///< CLOCK_BOOTTIME
  std::optional<Eigen::Vector3d> gyro, accel;  ///< rad/s and m/s²
};

class IioStream {
 public:
  /// Starts the thread, on which `give` is called.
  IioStream(IioSettings settings, std::function<void(const IioScan&)> give);
  ~IioStream();
  IioStream(const IioStream&) = delete;
  IioStream& operator=(const IioStream&) = delete;

  /// Returns the state, with the counts "imu_absent" (failed openings), "imu_lost" (data stopped)
  /// and "imu_clock_jump".
  const DeviceState& state() const { return state_; }

 private:
  class Device;
  void run();
  void flow(Device& device);

  const IioSettings settings_;
  const std::function<void(const IioScan&)> give_;
  std::atomic<bool> stopping_{false};
  std::mutex mutex_;
  iio_buffer* open_ = nullptr;  ///< cancelled when the stream must stop
  DeviceState state_{"the IMU has not been opened yet"};
  std::thread thread_;
};

}  // namespace perdure::capture
