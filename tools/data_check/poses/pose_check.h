// Checks whether given poses rotate and accelerate as the drive's sensors measure. Judges their
// direction (T_WB or its inverse), axes, order of quaternion elements, and unit of length.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "common/replay/data_check.h"
#include "common/replay/files/pose_file.h"
#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// The poses with their times; a pose of a KITTI file has the stamp of its frame.
std::vector<replay::StampedPose> timedPoses(const replay::PoseFile& file,
                                            const replay::Recording& recording);

/// Compares the poses with the gyroscope. Codes: poses_without_turning, poses_inverted,
/// poses_conjugated, poses_w_first, poses_of_camera, poses_other_axes, poses_contradict_gyro,
/// poses_time_offset, poses_clock_rate. Returns nothing if the rotation is too small.
replay::DataFindings judgePosesByGyro(const std::vector<replay::StampedPose>& poses,
                                      const replay::Recording& recording);

/// Compares the poses with the image rotations of turnsOfImages in the same way.
replay::DataFindings judgePosesByImages(const std::vector<replay::StampedPose>& poses,
                                        const std::vector<Turn>& turns,
                                        const replay::Recording& recording);

/// Decides by accelerations and the smoothness of positions whether the whole pose was inverted or
/// only the quaternion conjugated; the rotations of both are equal.
enum class Inversion { kUnsure, kPose, kQuaternion };
Inversion howInverted(const std::vector<replay::StampedPose>& poses,
                      const replay::Recording& recording, bool of_camera);

/// The finding for poses whose times are `later_s` before those of a sensor. `what` names its
/// motion, as "the gyroscope turns". Code: poses_time_offset.
replay::DataFinding posesAtOtherTimes(const std::string& what, double later_s, bool may_be_more);

/// Finds poses whose accelerations agree with the accelerometer only at other times, on drives that
/// are too straight for the gyroscope. Code: poses_time_offset.
replay::DataFindings judgePosesByPushes(const std::vector<replay::StampedPose>& poses,
                                        const replay::Recording& recording);

/// Finds constant orientations although the gyroscope rotates. Code: poses_without_turning.
replay::DataFindings judgePoseTurning(const std::vector<replay::StampedPose>& poses,
                                      const std::vector<Eigen::Vector3d>& gyro_turns);

/// Finds constant positions although the accelerometer measures motion. Needs correct orientations.
/// Code: poses_without_positions.
replay::DataFindings judgePoseMoving(const std::vector<replay::StampedPose>& poses,
                                     const replay::Recording& recording);

/// Finds poses of the camera (z forward) that are declared as poses of the body. Needs twenty
/// metres in a constant direction of the body. Code: poses_of_camera.
replay::DataFindings judgePosesOfCamera(const std::vector<replay::StampedPose>& poses,
                                        const replay::Recording& recording);

/// Finds poses that always move backwards while the speed is positive. Code: poses_backwards.
replay::DataFindings judgePosesBackwards(const std::vector<replay::StampedPose>& poses,
                                         const replay::Recording& recording);

/// Finds a pose that is repeated for 0.4 s or more while the gyroscope, the speed or (if `images`)
/// the images show motion; also one whose position then jumps, or that stops and starts without
/// braking. Code: poses_frozen.
replay::DataFindings judgePosesFrozen(const std::vector<replay::StampedPose>& poses,
                                      const replay::Recording& recording, bool images);

/// Text with the time ranges of frames and poses, for poses that match no frame. Neither may be
/// empty.
std::string timesBeside(const replay::Recording& recording,
                        const std::vector<replay::StampedPose>& poses);

/// Finds poses that are all before the first frame or after the last one. Code: poses_elsewhere.
replay::DataFindings judgePoseTimes(const replay::PoseFile& file,
                                    const replay::Recording& recording);

/// Finds neighbours farther apart than any motion explains. Code: poses_jump.
replay::DataFindings judgePoseJumps(const std::vector<replay::StampedPose>& poses);

/// Finds positions in another world frame than the orientations. Codes: poses_other_position_axes,
/// poses_of_camera, poses_in_degrees.
replay::DataFindings judgePoseAxes(const std::vector<replay::StampedPose>& poses,
                                   const replay::Recording& recording);

/// Judges the unit of length by accelerometer and gyroscope; without them, by a speed that no
/// vehicle reaches. Needs correct rotations. Codes: poses_unit, poses_too_fast.
replay::DataFindings judgePoseUnit(const std::vector<replay::StampedPose>& poses,
                                   const replay::Recording& recording);

}  // namespace perdure::tools
