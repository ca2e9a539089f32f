// Tracks of boxes over successive frames, and how far their centres are from views of one point.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/camera/camera_model.h"
#include "tools/outputs/pictures/drive_log.h"

namespace perdure::tools {

using FrameGlances = std::map<std::uint64_t, FrameGlance>;

/// The smallest and largest coordinates of all boxes.
Box extentOf(const FrameGlances& frames);

struct BoxView {
  std::uint64_t frame = 0;
  Box box;
  std::size_t best_class = 0;
};
/// Successive boxes of one object.
using BoxTrack = std::vector<BoxView>;

inline constexpr std::size_t kLeastBoxViews = 8, kMostBoxViews = 20;

/// Follows boxes from one frame with boxes to the next by their overlap. Boxes at the border of all
/// boxes are left out, because their centres move with the visible part.
std::vector<BoxTrack> tracksOf(const FrameGlances& frames);

/// A change of the coordinates and frame numbers of boxes.
struct BoxChange {
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();  ///< right pixel = A · given pixel + b
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  std::int64_t times = 1, per = 1,
               shift = 0;  ///< right number = times · given number / per + shift
};

inline constexpr double kWorstDeviation = 10.0;  ///< of a track that no point explains

/// Deviations of the changed centres from the views of the best point, in sizes of the boxes. All
/// are kWorstDeviation if no point explains the views. Returns nothing if too few frames have
/// poses.
std::optional<Eigen::Matrix2Xd> deviationsOf(const BoxTrack& track, const BoxChange& change,
                                             const FrameGlances& frames, const CameraModel& camera);

/// RMS distance, at most kWorstDeviation.
double residualOf(const Eigen::Matrix2Xd& deviations);

}  // namespace perdure::tools
