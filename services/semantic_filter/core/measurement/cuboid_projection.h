// The image of a thing in its cuboid: the box around its corners, with Jacobians (b = π(g s) of
// eq. 7). The cuboid stands upright: its z axis is against gravity; yaw 0 has its length along x of
// W.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "common/camera/camera_model.h"
#include "services/semantic_filter/core/belief/state.h"
#include "services/semantic_filter/core/measurement/polygon.h"
#include "services/semantic_filter/core/measurement/view.h"

namespace perdure::semantic_filter {

struct ProjectedBox {
  Eigen::Vector4d sides = Eigen::Vector4d::Zero();  ///< x1, y1, x2, y2; may lie outside the image
  Eigen::Matrix<double, 4, kStateDim> H = Eigen::Matrix<double, 4, kStateDim>::Zero();
  Eigen::Matrix<double, 4, 6> H_pose = Eigen::Matrix<double, 4, 6>::Zero();  ///< by [θ, p] of T_WB
  std::array<bool, 4> exact{true, true, true, true};  ///< false: set by the near plane's cut
};

/// The same without derivatives.
struct ProjectedOutline {
  Eigen::Vector4d sides;  ///< x1, y1, x2, y2; may lie outside the image
  Polygon points;         ///< images of corners and cuts by the near plane, in no order
};

/// Nothing where no part of the cuboid is in front of the near plane (0.2 m).
/// The box is of `shape` within the cuboid, or of all of it where that reaches the near plane.
/// `heading` as in Shape::corner.
std::optional<ProjectedBox> projectCuboid(const State& x, const Projector& from,
                                          const Shape& shape = cuboidShape(), double heading = 0.0);
std::optional<ProjectedOutline> projectOutline(const State& x, const Projector& from,
                                               const Shape& shape = cuboidShape());

/// How a detector draws its boxes about things of a class.
struct BoxStyle {
  Eigen::Vector4d offset = Eigen::Vector4d::Zero();  ///< mean, in widths and heights, like b
  Shape shape = cuboidShape();                       ///< what they enclose of the cuboid
};

/// What a detector reports of it: the shape's box with the hypothesis's b and the style's offset
/// added to its sides.
std::optional<ProjectedBox> projectObserved(const State& x, const Projector& from,
                                            const BoxStyle& style, double heading = 0.0);

/// Yaw in W from KITTI's alpha seen at `centre_W`: alpha = rotation_y - atan2(x, z) of the centre,
/// in the gravity-levelled camera frame (DESIGN 5, item 8).
double yawFromAzimuth(double azimuth, const Eigen::Vector3d& centre_W, const View& view);

}  // namespace perdure::semantic_filter
