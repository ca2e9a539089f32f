// Tests of images, speed and position. Health reports the problems that they find.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <string>

#include "common/base/time.h"
#include "common/types/odometry.h"

namespace perdure::vio {

/// Counts consecutive frames without a result.
class InVain {
 public:
  /// Adds a frame without a result. `why` is a sentence, which is reported from the `from`-th such
  /// frame on.
  void add(std::string why, int from) {
    ++frames_;
    why_ = frames_ >= from ? std::move(why) : std::string();
  }
  /// Adds a frame with a result.
  void clear() { frames_ = 0, why_.clear(); }
  /// Returns the problem as a sentence; empty if there is none, or before the `from`-th frame.
  const std::string& sentence() const { return why_; }

 private:
  int frames_ = 0;
  std::string why_;
};

/// Number of frames from which InVain reports: in general, and for frames of another size. Of these
/// only one may be left over from before a change, so fewer suffice.
inline constexpr int kInVain = 10;
inline constexpr int kOtherSizes = 2;
inline constexpr char kNoImage[] = "images cannot be read; fix the camera";

/// Detects that the speed was refused for most of the last second.
class SpeedDoubt {
 public:
  /// Adds the next image. `refused` is true if the gate refused the speed, and empty if there was
  /// none.
  void add(TimePoint now, std::optional<bool> refused) {
    const double passed_s = last_ ? toSeconds(now - *last_) : 0.0;
    last_ = now;
    const double forgets = std::clamp(passed_s / kMemory_s, 0.0, 1.0);
    share_ += forgets * ((refused.value_or(false) ? 1.0 : 0.0) - share_);
  }
  /// Returns the problem as a sentence; empty if there is none.
  const char* sentence() const {
    if (share_ < kMost) return "";
    return "the speed contradicts camera and IMU and is refused: see its unit (m/s), its sign "
           "(forwards is positive), its scale and its stamps; or the wheels slip";
  }

 private:
  static constexpr double kMemory_s = 1.0, kMost = 0.6;  // reached after 0.9 s if all are refused
  double share_ = 0.0;
  std::optional<TimePoint> last_;
};

/// Detects that the position's deviation has grown by more than a limit in ten seconds. Growth that
/// the heading's error causes is not counted.
class PositionDoubt {
 public:
  explicit PositionDoubt(double limit_m) : limit_m_(limit_m) {}

  /// Adds the next pose of the same world. Returns true if its position is uncertain.
  bool add(TimePoint now, const Eigen::Vector3d& p_W, const Matrix9d& covariance) {
    const double sigma = std::sqrt(covariance.block<3, 3>(3, 3).trace());
    while (!before_.empty() && before_.front().time < now - std::chrono::seconds(10)) {
      before_.pop_front();
    }
    before_.push_back({now, p_W, sigma});
    const Pose& then = before_.front();
    const double by_heading =
        std::sqrt(covariance.block<3, 3>(0, 0).trace()) * (p_W - then.p_W).norm();
    return uncertain_ = sigma - then.sigma > limit_m_ + by_heading;
  }
  bool uncertain() const { return uncertain_; }
  void clear() {
    before_.clear();
    uncertain_ = false;
  }

 private:
  double limit_m_;
  struct Pose {
    TimePoint time;
    Eigen::Vector3d p_W;
    double sigma;  ///< m
  };
  std::deque<Pose> before_;
  bool uncertain_ = false;
};

}  // namespace perdure::vio
