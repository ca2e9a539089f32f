// L_k(z): how much better a box is explained by a hypothesis than by clutter (eq. 6, 7).
//
// A side of a box is *measured* (a density in px⁻¹) or *censored*: cut by the image border or by a
// nearer track, where only "the true side lies beyond" is known (a probability). Clutter is
// measured in the same event, so that units agree (DESIGN 5, item 5).
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "common/types/detections.h"
#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

struct BoxMeasurement {
  Eigen::Vector4d sides = Eigen::Vector4d::Zero();     ///< x1, y1, x2, y2, pixels
  Eigen::Vector4d variance = Eigen::Vector4d::Ones();  ///< px², of each side
  Eigen::Vector4d lasting = Eigen::Vector4d::Zero();   ///< px², of the track's b at each side
  std::array<bool, 4> measured{true, true, true, true};

  int count() const;
  double width() const { return sides[2] - sides[0]; }
  double height() const { return sides[3] - sides[1]; }
  Box box() const { return {sides[0], sides[1], sides[2], sides[3]}; }
};

/// What a network says of the errors of its boxes; 0 where it does not.
struct BoxNoise {
  double relative = 0.0;          ///< deviation of a side, in widths or heights of a large box
  double pixel = 0.0;             ///< a pixel of the network's input, in pixels of the image
  std::array<double, 4> sides{};  ///< of this box's sides, in pixels of the image
  double inflation =
      0.0;  ///< probability of clutter: what a network inflations it also places worse
};

/// Standard deviation of a side of a box.
struct SideError {
  double pixels = 0.0;    ///< of the image
  double relative = 0.0;  ///< of the box's width (x sides) or height (y sides)

  double at(double size_px) const { return pixels + relative * size_px; }
  SideError operator*(double factor) const { return {pixels * factor, relative * factor}; }
};
/// Of noise and b together.
SideError sideError(const BoxParameters& parameters, const BoxNoise& noise);
/// The part of it that stays with the track while the view stays: b.
SideError lastingError(const BoxParameters& parameters, const BoxNoise& noise);

/// The box of a detection, its sides cut at the border of a width × height image marked censored.
/// The variance is that of the noise: the share that is the track's b is in its state. Where the
/// network says how sure a side is, that is the whole of noise and b.
BoxMeasurement measure(const Box& box, double width, double height, const BoxParameters& parameters,
                       const BoxNoise& noise = {});
/// Standard deviation of b, in widths and heights, of a box of this size in pixels.
Eigen::Vector4d biasSigma(const SideError& lasting, double width_px, double height_px);

/// log of the clutter measure of the box: expected false boxes times the density (measured sides)
/// or probability (censored ones) of one of them being this one, wherever its `ignored` sides are.
double logClutter(const BoxMeasurement& z, double width, double height,
                  const ClutterParameters& parameters, const std::array<bool, 4>& ignored = {});

/// Covariance of the four predicted sides: S without R of DESIGN 5, item 2.
Eigen::Matrix4d predictedCovariance(const Hypothesis& h, const ProjectedBox& box,
                                    const Eigen::Matrix<double, 6, 6>& P_pose);

/// Whether the box lies near enough to be worth scoring, by five deviations.
bool mayOverlap(const BoxMeasurement& z, const ProjectedBox& predicted,
                const Eigen::Matrix4d& covariance);

struct BoxScore {
  double log_density = 0.0;       ///< of measured sides, with the probability of the censored ones
  std::array<bool, 4> ignored{};  ///< measured sides of which nothing is predicted
  double nis = 0.0;               ///< squared Mahalanobis distance of the measured sides
  int dof = 0;
  int part = -1;  ///< side at which the box shows a part of the thing alone; -1: none
};

/// log t(z; h(x), S) with `tail` degrees of freedom and with censoring. `hidden` are sides that a
/// nearer track hides: the box shows the whole thing all the same (`amodal`), or ends anywhere
/// within it. It may do that at one side that nothing on the map hides, too (`part`). Nothing where
/// no side can be compared, or outside the gate.
std::optional<BoxScore> scoreBox(const BoxMeasurement& z, const ProjectedBox& predicted,
                                 const Eigen::Matrix4d& covariance,
                                 const std::array<bool, 4>& hidden,
                                 const BoxParameters& parameters);

/// Sides that can be compared: measured, not hidden, and exact in the projection.
std::array<bool, 4> comparableSides(const BoxMeasurement& z, const ProjectedBox& predicted,
                                    const std::array<bool, 4>& hidden);

}  // namespace perdure::semantic_filter
