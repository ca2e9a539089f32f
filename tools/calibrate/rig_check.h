// Judges a rig file by a recording of any place: vio runs with it, and how images meet its
// predictions says what the rig is worth.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/vio/config.h"
#include "services/vio/core/update/updater_slam.h"
#include "services/vio/node.h"
#include "tools/calibrate/verdict.h"

namespace perdure::calibrate {

struct RigCheckOptions {
  std::filesystem::path data, rig;  ///< rig: empty for the drive's own calibration
  std::string sequence = {};        ///< of KITTI tracking or 7-Scenes
  double seconds = 60.0;            ///< of the drive, at most
  bool until_sure = false;          ///< ends where all is good and vio is sure of it
  vio::Config vio = {};
};

/// What vio came to believe of the first camera's place, against the rig; and how it fared.
struct RigCheck {
  CameraCalibration camera;
  std::size_t cameras = 1;
  std::size_t frames = 0, tracked = 0, resets = 0;
  std::size_t holes = 0;  ///< of the resets: stamps jumped, or samples were missing
  std::size_t speed_refused = 0;
  std::size_t contradicted = 0;  ///< frames at which most of the last seconds' points were refused
  std::vector<vio::Innovation> innovations;
  bool believed = false;  ///< vio had a start and the following four say something
  Eigen::Vector3d turned = Eigen::Vector3d::Zero();   ///< rad, right of R_BC
  Eigen::Vector3d shifted = Eigen::Vector3d::Zero();  ///< m, in B
  double later_s = 0.0;                               ///< time offset less the rig's
  Eigen::Matrix<double, 7, 1> sigma = Eigen::Matrix<double, 7, 1>::Zero();  ///< of these
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = gyro_bias;
  double gyro_bias_change = 0.0, accel_bias_change = 0.0;  ///< over the second half of the drive
};

/// All is good, and what is bad would be told: deviations are at most half of what is good.
bool isSurelyGood(const RigCheck& check);

/// Listens to a vio as it runs.
class RigWatch {
 public:
  /// What comes later than `seconds` after the first odometry is not looked at.
  RigWatch(const CameraCalibration& camera, double seconds);
  void onOdometry(const Odometry& odometry);
  void onInnovations(const std::vector<vio::Innovation>& innovations);
  /// After an image: a filter that resets forgets, and the last belief before counts.
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

/// Throws StartupError where the recording or the rig cannot be read, or has no images or samples.
RigCheck checkRig(const RigCheckOptions& options);

/// Median of the normalised innovations squared over what it is to be (1 where all is as believed).
double innovationRatio(const std::vector<vio::Innovation>& innovations);
/// How vio fared, then judgeBelief where it fared well enough.
Judgements judgeRig(const RigCheck& check);
/// What it came to believe of lens, place and IMU; that there is too little to tell by, too.
Judgements judgeBelief(const RigCheck& check);

/// Whether so much contradicts with two cameras that it is worth to look with the first one alone,
/// and what that says: nothing where it contradicts as well.
bool isSecondSuspect(const RigCheck& check);
Judgements judgeSecond(const RigCheck& both, const RigCheck& alone);

}  // namespace perdure::calibrate
