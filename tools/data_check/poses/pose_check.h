// Whether poses that are given turn and accelerate as the drive's own sensors say: their direction
// (T_WB or its inverse), their axes, the order of their quaternions, their unit of length.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "common/replay/data_check.h"
#include "common/replay/files/pose_file.h"
#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// Those that the drive's frames or clock know, with times; a KITTI pose has that of its frame.
std::vector<replay::StampedPose> timedPoses(const replay::PoseFile& file,
                                            const replay::Recording& recording);

/// Against the gyroscope. Codes: poses_without_turning, poses_inverted, poses_conjugated,
/// poses_w_first, poses_of_camera, poses_other_axes, poses_contradict_gyro, poses_time_offset,
/// poses_clock_rate. Nothing where too little turns to tell.
replay::DataFindings judgePosesByGyro(const std::vector<replay::StampedPose>& poses,
                                      const replay::Recording& recording);

/// The same, against the images' turns (turnsOfImages).
replay::DataFindings judgePosesByImages(const std::vector<replay::StampedPose>& poses,
                                        const std::vector<Turn>& turns,
                                        const replay::Recording& recording);

/// Where turns are those of an inverse: whether the whole pose was inverted, or the quaternion
/// alone was conjugated, by the accelerations and by which positions are smooth.
enum class Inversion { kUnsure, kPose, kQuaternion };
Inversion howInverted(const std::vector<replay::StampedPose>& poses,
                      const replay::Recording& recording, bool of_camera);

/// Orientations that stay while the gyroscope turns so from second to second. Code:
/// poses_without_turning.
replay::DataFindings judgePoseTurning(const std::vector<replay::StampedPose>& poses,
                                      const std::vector<Eigen::Vector3d>& gyro_turns);

/// Positions that stay while the accelerometer says otherwise; for right orientations. Code:
/// poses_without_positions.
replay::DataFindings judgePoseMoving(const std::vector<replay::StampedPose>& poses,
                                     const replay::Recording& recording);

/// The times of the frames beside those of poses that are none of theirs. Both are not empty.
std::string timesBeside(const replay::Recording& recording,
                        const std::vector<replay::StampedPose>& poses);

/// Poses with times, all of them before the first frame or after the last one. Code:
/// poses_elsewhere.
replay::DataFindings judgePoseTimes(const replay::PoseFile& file,
                                    const replay::Recording& recording);

/// Neighbours so far apart as no motion explains. Code: poses_jump.
replay::DataFindings judgePoseJumps(const std::vector<replay::StampedPose>& poses);

/// Positions in another world than the orientations. Codes: poses_other_position_axes,
/// poses_in_degrees.
replay::DataFindings judgePoseAxes(const std::vector<replay::StampedPose>& poses,
                                   const replay::Recording& recording);

/// The unit of length: by accelerometer and gyroscope where there are any, else by a speed that no
/// vehicle has. Codes: poses_unit, poses_too_fast. Poses whose turning is right.
replay::DataFindings judgePoseUnit(const std::vector<replay::StampedPose>& poses,
                                   const replay::Recording& recording);

}  // namespace perdure::tools
