// The part of the filter that is saved across restarts, as text.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/base/ids.h"
#include "common/base/result.h"
#include "services/vio/core/state/state.h"

namespace perdure::vio {

struct SavedState {
  WorldId world;
  TimePoint time;  ///< IMU clock
  Nav nav;
  std::vector<RigidTransform> T_BC;
  double time_offset_s = 0.0;
  std::vector<double> readout_s;  ///< read-out time of each camera
  std::vector<LensError> lens;    ///< of each camera
  Eigen::Vector3d gyro_scale = Eigen::Vector3d::Ones();
  Estimated estimated;
  Eigen::MatrixXd covariance;  ///< of State's error without clones and points
  std::uint64_t next_track = 1;
};

std::string toText(const SavedState& saved);
/// Parses a state. Fails with "state_malformed" if the text is truncated, altered, of another
/// version or not finite.
Result<SavedState> fromText(const std::string& text);

/// Propagates the state at constant velocity over `gap_s`, and enlarges the covariance for the
/// unobserved motion.
void coast(SavedState& saved, double gap_s);

}  // namespace perdure::vio
