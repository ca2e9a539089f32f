// Checks whether images rotate as the gyroscope measures: its unit, the camera's rotation relative
// to the IMU (inverted T_BS) and the time offset. Image rotations are robust fits to the flow of
// corners; translation causes outliers, or the same error in all pairs. Both lists of rotations are
// compared without their means, so that a bias has no effect.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "common/replay/data_check.h"
#include "common/replay/files/pose_file.h"

namespace perdure::tools {

/// Rotation between two images.
struct Turn {
  TimePoint from, to;
  Eigen::Vector3d of_images = Eigen::Vector3d::Zero();  ///< rad, in C
};

/// Rotations by the index of the pair's first image among those of cam0; empty where fewer than 15
/// corners could be tracked.
using KnownTurns = std::map<std::size_t, std::optional<Turn>>;

/// Rotations of up to `most` consecutive image pairs of cam0, chosen at the largest changes of the
/// rates of `samples`. Pairs with fewer than 15 tracked corners are omitted. Images of pairs in
/// `known` are not read again; what is read is added to it.
std::vector<Turn> turnsOfImages(const replay::Recording& recording,
                                const std::vector<ImuSample>& samples, std::size_t most = 60,
                                KnownTurns* known = nullptr);

/// Rotations of image pairs of cam0 at places all over the drive, independent of the IMU.
std::vector<Turn> turnsAlong(const replay::Recording& recording, KnownTurns* known = nullptr);

/// Whether the images or the gyroscope rotate enough for a judgement and contradict each other.
bool disagree(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
              const CameraCalibration& camera);

/// Codes: gyro_in_degrees, gyro_scale, images_still, gyro_too_small, gyro_constant, gyro_factor,
/// T_BS_inverted, T_BS_turned, time_offset. Returns nothing if images or gyroscope rotate too
/// little.
replay::DataFindings judgeTurns(const std::vector<Turn>& turns,
                                const std::vector<ImuSample>& samples,
                                const CameraCalibration& camera);

/// Returns the time offset in s with which the gyroscope explains the image rotation at least three
/// times as well as with the camera's own. Returns nothing if there is no such offset.
std::optional<double> offsetOfTurns(const std::vector<Turn>& turns,
                                    const std::vector<ImuSample>& samples,
                                    const CameraCalibration& camera);

/// Rotation rates between consecutive poses, as a gyroscope on B would measure them.
std::vector<ImuSample> turnsOfPoses(const std::vector<replay::StampedPose>& poses);

/// Compares the poses' rotations with the images'. Code: poses_time_offset. `samples`: from
/// turnsOfPoses.
replay::DataFindings judgePoseTurns(const std::vector<Turn>& turns,
                                    const std::vector<ImuSample>& samples,
                                    const CameraCalibration& camera);

}  // namespace perdure::tools
