// Judges a rig file by the innovations of vio over a recording of any scene.
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/replay/dataset.h"
#include "services/vio/config.h"
#include "services/vio/core/update/point_updates.h"
#include "services/vio/node.h"
#include "tools/calibrate/verdict.h"

namespace perdure::calibrate {

struct RigCheckOptions {
  std::filesystem::path data;  ///< the drive's name in messages
  double seconds = 60.0;       ///< largest duration of the drive that is used
  bool until_sure = false;     ///< ends when everything is good and vio is certain
  vio::Config vio = {};
  std::stop_token stop = {};  ///< ends the run early; its result is then of no use
};

/// Vio's estimate of the first camera's extrinsics, and the quality of vio's run.
struct RigCheck {
  CameraCalibration camera;
  std::size_t cameras = 1;
  std::size_t frames = 0, tracked = 0, resets = 0;
  std::size_t holes = 0;  ///< resets after a jump of stamps or missing samples
  std::size_t speed_refused = 0;
  std::size_t even = 0;          ///< images that moved before the start while the IMU did not
  std::size_t contradicted = 0;  ///< frames at which most points of the last seconds were rejected
  std::vector<vio::Innovation> innovations;
  bool believed = false;  ///< vio started, so that the following four are valid
  Eigen::Vector3d turned = Eigen::Vector3d::Zero();   ///< rad, right of R_BC
  Eigen::Vector3d shifted = Eigen::Vector3d::Zero();  ///< m, in B
  double later_s = 0.0;                               ///< estimated time offset minus the rig's
  Eigen::Matrix<double, 7, 1> sigma = Eigen::Matrix<double, 7, 1>::Zero();  ///< standard deviation
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = gyro_bias;
  double gyro_bias_change = 0.0, accel_bias_change = 0.0;  ///< changes in the second half
};

/// Whether all judgements are good, and vio is so certain that it would have detected bad values:
/// its standard deviations are at most a quarter of the limits.
bool isSurelyGood(const RigCheck& check);

class RigWatch {
 public:
  /// Ignores data later than `seconds` after the first odometry message.
  RigWatch(const CameraCalibration& camera, double seconds);
  void onOdometry(const Odometry& odometry);
  void onInnovations(const std::vector<vio::Innovation>& innovations);
  /// Stores vio's estimate after an image, because a reset of the filter discards it.
  void remember(const vio::Node& node);
  RigCheck check(const ReasonCounts& of_vio) const;

 private:
  bool late() const { return last_ && *last_ > until_; }

  RigCheck check_;
  Duration seconds_;
  TimePoint until_;
  std::optional<TimePoint> last_;
  std::string saved_;
  std::vector<Eigen::Vector3d> gyro_, accel_;
};

/// Returns the recording with fewer images: consecutive images are at most 110 ms or 0.05 rad
/// apart, if the recording allows it. Drives shorter than 30 s are unchanged, because vio needs all
/// their images.
replay::Recording thinned(replay::Recording recording);

/// Reads the drive's images in grey, from the start. Throws StartupError if there are no readable
/// images or samples.
RigCheck checkRig(replay::Dataset& drive, const RigCheckOptions& options);

/// Median of the normalised innovations squared divided by its expected value; 1 for a consistent
/// filter.
double innovationRatio(const std::vector<vio::Innovation>& innovations);
/// Judges vio's run and, if it was good enough, the estimates by judgeBelief.
Judgements judgeRig(const RigCheck& check);
/// Judges the estimates of lens, pose and IMU, or reports that there are too few data.
Judgements judgeBelief(const RigCheck& check);

/// Whether the two cameras contradict each other so much that vio should run with the first camera
/// alone. judgeSecond judges that run; it returns nothing if that run contradicts the rig as well.
bool isSecondSuspect(const RigCheck& check);
Judgements judgeSecond(const RigCheck& both, const RigCheck& alone);

}  // namespace perdure::calibrate
