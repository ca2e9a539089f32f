// Whether images turn as the gyroscope says: its unit, the camera's rotation on the IMU (T_BS given
// the wrong way round) and the time between the two. Rotations between images are those that
// explain the flow of their corners best (robust least squares; what the camera's own way adds is
// an outlier or the same in all pairs); both sides are compared without their means, so that a bias
// is none.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/replay/data_check.h"
#include "common/replay/files/pose_file.h"

namespace perdure::tools {

/// Between two images.
struct Turn {
  TimePoint from, to;
  Eigen::Vector3d of_images = Eigen::Vector3d::Zero();  ///< rad, in C
};

/// Of up to `most` pairs of images of cam0 that follow each other, where the rate of turn that
/// `samples` say changes most. Pairs with fewer than 15 corners that can be followed are left out.
std::vector<Turn> turnsOfImages(const replay::Recording& recording,
                                const std::vector<ImuSample>& samples, std::size_t most = 60);

/// Codes: gyro_in_degrees, images_still, gyro_too_small, gyro_constant, gyro_factor, T_BS_inverted,
/// T_BS_turned, time_offset. Nothing where images or gyroscope turn too little to tell.
replay::DataFindings judgeTurns(const std::vector<Turn>& turns,
                                const std::vector<ImuSample>& samples,
                                const CameraCalibration& camera);

/// The camera's time offset, s, with which the gyroscope explains the images' turning, and three
/// times as well as with the one given; nothing where none does.
std::optional<double> offsetOfTurns(const std::vector<Turn>& turns,
                                    const std::vector<ImuSample>& samples,
                                    const CameraCalibration& camera);

/// The rates of turn between poses that follow each other, as a gyroscope on B would say them.
std::vector<ImuSample> turnsOfPoses(const std::vector<replay::StampedPose>& poses);

/// Code: poses_time_offset. `samples`: turnsOfPoses.
replay::DataFindings judgePoseTurns(const std::vector<Turn>& turns,
                                    const std::vector<ImuSample>& samples,
                                    const CameraCalibration& camera);

}  // namespace perdure::tools
