// Doubts about images, speed and position, which Health reports.
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

/// Consecutive frames without a result.
class InVain {
 public:
  /// Adds a frame without a result. why: a sentence, reported from the `from`-th frame on.
  void add(std::string why, int from) {
    ++frames_;
    why_ = frames_ >= from ? std::move(why) : std::string();
  }
  /// Adds a frame with a result.
  void clear() { frames_ = 0, why_.clear(); }
  /// The problem as a sentence; empty if there is no problem, or during the first frames.
  const std::string& sentence() const { return why_; }

 private:
  int frames_ = 0;
  std::string why_;
};

/// Frames after which Health reports the reason; fewer for another size, of which one may remain.
inline constexpr int kInVain = 10;
inline constexpr int kOtherSizes = 2;
inline constexpr char kNoImage[] = "images cannot be read; fix the camera";

/// Whether the speed was refused for most of the last second.
class SpeedDoubt {
 public:
  /// Adds the next image. refused: whether the gate refused the speed; empty without a speed.
  void add(TimePoint now, std::optional<bool> refused) {
    const double passed_s = last_ ? toSeconds(now - *last_) : 0.0;
    last_ = now;
    const double forgets = std::clamp(passed_s / kMemory_s, 0.0, 1.0);
    share_ += forgets * ((refused.value_or(false) ? 1.0 : 0.0) - share_);
  }
  /// The problem as a sentence; empty if there is no problem.
  const char* sentence() const {
    if (share_ < kMost) return "";
    return "the speed contradicts camera and IMU and is refused: see its unit (m/s), its sign "
           "(forwards is positive), its scale and its stamps; or the wheels slip";
  }

 private:
  static constexpr double kMemory_s = 1.0, kMost = 0.6;  // exceeded after 0.9 s of refusals alone
  double share_ = 0.0;
  std::optional<TimePoint> last_;
};

/// Whether the position's deviation has grown by more than a limit in ten seconds, apart from the
/// effect of the heading's error.
class PositionDoubt {
 public:
  explicit PositionDoubt(double limit_m) : limit_m_(limit_m) {}

  /// Adds the next pose of the same world; true if its position is uncertain.
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
