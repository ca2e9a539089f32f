// Plays a simulated drive with drawn images to a node, and records the outputs.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "services/vio/node.h"
#include "tests/services/vio/drawn_drive.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio::test {

struct Recorder {
  std::vector<Odometry> odometry;
  std::vector<Landmarks> landmarks;
  Outputs outputs() {
    return {[this](const Odometry& o) { odometry.push_back(o); },
            [this](const Landmarks& l) { landmarks.push_back(l); }};
  }
};

inline Calibration calibration() {
  Calibration c;
  c.cameras = {testCamera(0)};
  c.imu = ImuCalibration{1.7e-4, 2e-5, 2e-3, 3e-3, 200.0};
  return c;
}

inline DriveOptions restThenDrive(double rest_s = 1.0) {
  DriveOptions options;
  options.rest_s = rest_s;
  options.points = 400;
  return options;
}

/// Plays the drive from `from` to `until`; the callbacks may change a message, or drop it (return
/// false).
class Player {
 public:
  explicit Player(double until, double rest_s = 1.0)
      : drive_(restThenDrive(rest_s)), readings_(drive_.imu(until + 0.1)) {}

  using EditImu = std::function<bool(ImuSample&, double)>;
  using EditFrame = std::function<bool(Frame&, double)>;

  void play(Node& node, double from, double until, const EditImu& imu = {},
            const EditFrame& frame = {}) {
    auto next_frame = static_cast<std::uint64_t>(std::lround(from / 0.05));
    for (std::size_t i = 0; i < readings_.size(); ++i) {
      const double t = 0.005 * static_cast<double>(i);
      if (t < from) continue;
      if (t > until) break;
      const double t_frame = 0.05 * static_cast<double>(next_frame);
      if (t >= t_frame) {
        Frame f = drawn(drive_, t_frame, next_frame++);
        if (!frame || frame(f, t_frame)) node.onFrame(f);
      }
      ImuSample s{1, i, readings_[i].time, readings_[i].gyro, readings_[i].accel};
      if (!imu || imu(s, t)) node.onImu(s);
    }
  }
  const SimulatedDrive& drive() const { return drive_; }

 private:
  SimulatedDrive drive_;
  std::vector<ImuReading> readings_;
};

inline std::size_t usable(const Recorder& r) {
  return static_cast<std::size_t>(
      std::count_if(r.odometry.begin(), r.odometry.end(),
                    [](const Odometry& o) { return o.state != OdometryState::kInitialising; }));
}

inline void expectFinite(const Recorder& r) {
  for (const Odometry& o : r.odometry) {
    EXPECT_TRUE(o.T_WB.finite());
    EXPECT_TRUE(o.v_WB.allFinite());
    EXPECT_TRUE(o.covariance.allFinite());
    EXPECT_TRUE(o.increment_covariance.allFinite());
    EXPECT_TRUE(o.transition.allFinite());
  }
}

inline double travelled(const Odometry& a, const Odometry& b) {
  return (a.T_WB.p - b.T_WB.p).norm();
}

}  // namespace perdure::vio::test
