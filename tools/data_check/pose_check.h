// Whether poses that are given turn and accelerate as the drive's own sensors say: their direction
// (T_WB or its inverse), their axes, the order of their quaternions, their unit of length.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "common/replay/data_check.h"
#include "common/replay/files/pose_file.h"
#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// Those that the drive's frames or clock know, with times; a KITTI pose has that of its frame.
std::vector<replay::StampedPose> timedPoses(const replay::PoseFile& file,
                                            const replay::Recording& recording);

/// Against the gyroscope. Codes: poses_inverted, poses_w_first, poses_of_camera, poses_other_axes,
/// poses_contradict_gyro, poses_time_offset. Nothing where too little turns to tell.
replay::DataFindings judgePosesByGyro(const std::vector<replay::StampedPose>& poses,
                                      const replay::Recording& recording);

/// The same, against the images' turns (turnsOfImages).
replay::DataFindings judgePosesByImages(const std::vector<replay::StampedPose>& poses,
                                        const std::vector<Turn>& turns,
                                        const CameraCalibration& camera);

/// The unit of length: by accelerometer and gyroscope where there are any, else by a speed that no
/// vehicle has. Codes: poses_unit, poses_too_fast. Poses whose turning is right.
replay::DataFindings judgePoseUnit(const std::vector<replay::StampedPose>& poses,
                                   const replay::Recording& recording);

}  // namespace perdure::tools
