// A simulated iiod with the part of its text protocol that the real libiio needs to find a network
// IMU and to stream it. Its measurements are known. It can disappear and return.
#pragma once

#include <atomic>
#include <cstdint>
#include <list>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace perdure::capture::testing {

struct FakeImu {
  std::string id = "iio:device0", name = "imu";
  bool gyro = true, accel = true, stamps = true;
  double rate_hz = 200.0;
  std::int64_t clock_ns = 0;   ///< its clock minus CLOCK_BOOTTIME
  std::string mount = {};      ///< mount matrix in IIO's text form; empty: none
  bool shared_mount = false;   ///< as in_mount_matrix, which libiio shows as a channel "mount"
  bool needs_trigger = false;  ///< scans come at the trigger's rate
  bool frozen_clock = false;   ///< every scan has the stamp of the first one
};

/// Raw values of scan i: gyro x, y, z = i % 1000, −7, 3 (scale .001), accel 5, −6, 981 (scale .01).
class FakeIiod {
 public:
  /// Listens on port 30431 of a loopback address such as "127.0.7.1".
  FakeIiod(std::string address, std::vector<FakeImu> devices);
  ~FakeIiod();
  FakeIiod(const FakeIiod&) = delete;
  FakeIiod& operator=(const FakeIiod&) = delete;

  const std::string& address() const { return address_; }
  /// Stops all answers, as if the cable were cut.
  void fallSilent() { silent_ = true; }
  void stepClock(std::int64_t ns) { step_ns_ += ns; }
  double rateAskedFor() const { return rate_asked_; }
  std::string triggerSet() const;
  /// Rate of "trigger0", an hrtimer; it accepts at most 500 Hz.
  double triggerRate() const { return trigger_rate_; }

 private:
  void serve();
  void talk(int socket);
  bool answer(int socket, const std::string& line, std::vector<std::int64_t>& next);
  bool answerRead(int socket, const std::string& id, const std::string& what);
  bool answerWrite(int socket, const std::string& id, const std::string& what);
  double rateOf(const FakeImu& device) const;
  bool sendScans(int socket, const FakeImu& device, std::size_t bytes, std::int64_t& next);
  const FakeImu* find(const std::string& id) const;
  std::string xml() const;

  const std::string address_;
  const std::vector<FakeImu> devices_;
  const std::int64_t start_ns_;
  int listener_ = -1;
  std::atomic<bool> stopping_{false}, silent_{false};
  std::atomic<std::int64_t> step_ns_{0};
  std::atomic<double> rate_asked_{0.0}, trigger_rate_{100.0};
  mutable std::mutex mutex_;
  std::string trigger_;
  std::list<int> sockets_;
  std::list<std::thread> talks_;
  std::thread thread_;
};

}  // namespace perdure::capture::testing
