// Predicted box of an object in its cuboid: the box around the images of its corners, with
// Jacobians (b = π(g s) of the paper's eq. 7). Derivation: tools/docs/maths/cuboid_projection.md.
// The cuboid is upright: its z axis is against gravity. At yaw 0 its length is along x of W.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "services/semantic_filter/core/belief/state.h"
#include "services/semantic_filter/core/measurement/polygon.h"
#include "services/semantic_filter/core/measurement/view.h"

namespace perdure::semantic_filter {

struct ProjectedBox {
  /// x1, y1, x2, y2, px; may lie outside the image
  Eigen::Vector4d sides = Eigen::Vector4d::Zero();
  Eigen::Matrix<double, 4, kStateDim> H = Eigen::Matrix<double, 4, kStateDim>::Zero();
  /// derivative of the sides by the pose error [θ, p] of T_WB
  Eigen::Matrix<double, 4, 6> H_pose = Eigen::Matrix<double, 4, 6>::Zero();
  /// false: the side is a cut by the near plane
  std::array<bool, 4> exact{true, true, true, true};
};

/// A projected box without derivatives, but with the points of the outline.
struct ProjectedOutline {
  Eigen::Vector4d sides;  ///< x1, y1, x2, y2, px; may lie outside the image
  Polygon points;         ///< px; corners and cuts by the near plane, in no order
};

/// Projects `shape`, or the whole cuboid if it reaches the near plane (0.2 m). Returns nothing if
/// the object is behind this plane.
std::optional<ProjectedBox> projectCuboid(const State& x, const Projector& from,
                                          const Shape& shape = cuboidShape(), double heading = 0.0);
std::optional<ProjectedOutline> projectOutline(const State& x, const Projector& from,
                                               const Shape& shape = cuboidShape());

/// Properties of the boxes that a network draws around objects of a class.
struct BoxStyle {
  /// mean offset of the sides, in widths and heights, like b
  Eigen::Vector4d offset = Eigen::Vector4d::Zero();
  Shape shape = cuboidShape();  ///< the part of the cuboid that the box encloses
};

/// Returns the box that the network should report: that of the shape, with b of the hypothesis and
/// the offset of the style. If the border cuts the shape, the other two sides are those of the part
/// inside. A side beyond the border stays there.
std::optional<ProjectedBox> projectObserved(const State& x, const Projector& from,
                                            const BoxStyle& style, double heading = 0.0);

/// Returns the yaw in W (rad) from KITTI's alpha of an object at `centre_W`. alpha = rotation_y -
/// atan2(x, z) of the centre, in the gravity-levelled camera frame. Derivation:
/// tools/docs/maths/azimuth_and_heading.md.
double yawFromAzimuth(double azimuth, const Eigen::Vector3d& centre_W, const View& view);

}  // namespace perdure::semantic_filter
