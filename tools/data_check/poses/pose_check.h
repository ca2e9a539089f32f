// Checks whether given poses rotate and accelerate as the drive's sensors measure. It judges their
// direction (T_WB or its inverse), their axes, the order of their quaternions, and their unit of
// length.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "common/replay/data_check.h"
#include "common/replay/files/pose_file.h"
#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// The poses with their times; a KITTI pose has the time of its frame.
std::vector<replay::StampedPose> timedPoses(const replay::PoseFile& file,
                                            const replay::Recording& recording);

/// Compares with the gyroscope. Codes: poses_without_turning, poses_inverted, poses_conjugated,
/// poses_w_first, poses_of_camera, poses_other_axes, poses_contradict_gyro, poses_time_offset,
/// poses_clock_rate. Returns nothing if the rotation is too small.
replay::DataFindings judgePosesByGyro(const std::vector<replay::StampedPose>& poses,
                                      const replay::Recording& recording);

/// Compares with the image rotations of turnsOfImages in the same way.
replay::DataFindings judgePosesByImages(const std::vector<replay::StampedPose>& poses,
                                        const std::vector<Turn>& turns,
                                        const replay::Recording& recording);

/// Decides whether the whole pose was inverted or only the quaternion conjugated, if the rotations
/// are those of an inverse. The accelerations and the smoothness of positions decide.
enum class Inversion { kUnsure, kPose, kQuaternion };
Inversion howInverted(const std::vector<replay::StampedPose>& poses,
                      const replay::Recording& recording, bool of_camera);

/// Constant orientations although the gyroscope measures rotation. Code: poses_without_turning.
replay::DataFindings judgePoseTurning(const std::vector<replay::StampedPose>& poses,
                                      const std::vector<Eigen::Vector3d>& gyro_turns);

/// Constant positions although the accelerometer measures motion; needs correct orientations. Code:
/// poses_without_positions.
replay::DataFindings judgePoseMoving(const std::vector<replay::StampedPose>& poses,
                                     const replay::Recording& recording);

/// Poses of the camera, z forward, if they travel upwards as those of the body. Code:
/// poses_of_camera. Needs twenty metres in a constant direction of the body.
replay::DataFindings judgePosesOfCamera(const std::vector<replay::StampedPose>& poses,
                                        const replay::Recording& recording);

/// Poses that move backwards all the time while the speed is positive. Code: poses_backwards.
replay::DataFindings judgePosesBackwards(const std::vector<replay::StampedPose>& poses,
                                         const replay::Recording& recording);

/// A pose that is repeated for over .4 s while gyroscope, speed or (`images`) images move.
/// Code: poses_frozen.
replay::DataFindings judgePosesFrozen(const std::vector<replay::StampedPose>& poses,
                                      const replay::Recording& recording, bool images);

/// Text with the times of the frames and those of poses that match no frame. Both must not be
/// empty.
std::string timesBeside(const replay::Recording& recording,
                        const std::vector<replay::StampedPose>& poses);

/// Poses that are all before the first frame or after the last one. Code: poses_elsewhere.
replay::DataFindings judgePoseTimes(const replay::PoseFile& file,
                                    const replay::Recording& recording);

/// Neighbours farther apart than any motion explains. Code: poses_jump.
replay::DataFindings judgePoseJumps(const std::vector<replay::StampedPose>& poses);

/// Positions in a different world frame than the orientations. Codes: poses_other_position_axes,
/// poses_of_camera, poses_in_degrees.
replay::DataFindings judgePoseAxes(const std::vector<replay::StampedPose>& poses,
                                   const replay::Recording& recording);

/// The unit of length, judged by accelerometer and gyroscope if they exist, otherwise by a speed
/// that no vehicle reaches. Needs correct rotations. Codes: poses_unit, poses_too_fast.
replay::DataFindings judgePoseUnit(const std::vector<replay::StampedPose>& poses,
                                   const replay::Recording& recording);

}  // namespace perdure::tools
