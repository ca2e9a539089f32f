// Measurement likelihood L_k(z): how much better a hypothesis explains a box than clutter does
// (paper, eq. 6 and 7). A measured side counts with its density (px⁻¹). A censored side, which the
// border or a nearer object cuts, counts with the probability that the true side lies beyond.
// Derivation: tools/docs/maths/measurement_likelihood.md.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "common/types/detections.h"
#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

struct BoxMeasurement {
  Eigen::Vector4d sides = Eigen::Vector4d::Zero();     ///< x1, y1, x2, y2, px
  Eigen::Vector4d variance = Eigen::Vector4d::Ones();  ///< px², noise of each side without b
  Eigen::Vector4d lasting = Eigen::Vector4d::Zero();  ///< px², variance that b causes at each side
  std::array<bool, 4> measured{true, true, true, true};

  int count() const;
  double width() const { return sides[2] - sides[0]; }
  double height() const { return sides[3] - sides[1]; }
  Box box() const { return {sides[0], sides[1], sides[2], sides[3]}; }
};

/// Errors of boxes as the network states them; 0: not stated.
struct BoxNoise {
  double relative = 0.0;             ///< deviation of a side of a large box, in widths or heights
  double pixel = 0.0;                ///< size of a pixel of the network's input, in image pixels
  std::array<double, 4> sides{};     ///< deviations of this box's sides, in image pixels
  double clutter_probability = 0.0;  ///< boxes with a high clutter probability have larger errors
};

struct SideError {
  double pixels = 0.0;    ///< image pixels
  double relative = 0.0;  ///< in box widths (x sides) or heights (y sides)

  double at(double size_px) const { return pixels + relative * size_px; }
  SideError operator*(double factor) const { return {pixels * factor, relative * factor}; }
};
/// Returns the standard deviation of a side, by noise and b together.
SideError sideError(const BoxParameters& parameters, const BoxNoise& noise);
/// Returns the standard deviation of a side by b, the error that stays while the view stays.
SideError lastingError(const BoxParameters& parameters, const BoxNoise& noise);

/// Returns the measurement of a box in an image of width × height pixels. Sides at the image border
/// are censored. The variance is that of the noise only, because the share of b is in the state. A
/// deviation that the network gives covers noise and b together.
BoxMeasurement measure(const Box& box, double width, double height, const BoxParameters& parameters,
                       const BoxNoise& noise = {});
/// Returns the deviation of b, in widths and heights, for a box of this size in pixels.
Eigen::Vector4d biasSigma(const SideError& lasting, double width_px, double height_px);

/// Returns the log of the clutter measure of the box: expected false boxes, times the density
/// (measured sides) or probability (censored sides) of this box without `ignored` sides.
double logClutter(const BoxMeasurement& z, double width, double height,
                  const ClutterParameters& parameters, const std::array<bool, 4>& ignored = {});

/// Returns the covariance of the four predicted sides, without noise, px².
Eigen::Matrix4d predictedCovariance(const Hypothesis& h, const ProjectedBox& box,
                                    const Eigen::Matrix<double, 6, 6>& P_pose);

/// Whether the box is within five deviations of the prediction; others need no score.
bool mayOverlap(const BoxMeasurement& z, const ProjectedBox& predicted,
                const Eigen::Matrix4d& covariance);

struct BoxScore {
  double log_density = 0.0;       ///< of measured sides, with the probability of censored ones
  std::array<bool, 4> ignored{};  ///< measured sides that the hypothesis does not predict
  double nis = 0.0;               ///< squared Mahalanobis distance of the measured sides
  int dof = 0;
  int part = -1;  ///< side at which a partial view ends within the object; -1: none
};

/// Returns log t(z; h(x), S), with `tail` degrees of freedom and censoring. If a nearer object
/// hides a side (`hidden`), the box spans the whole object all the same (`amodal`) or ends anywhere
/// within it. An unmapped object may hide one more side (`part`). Returns nothing outside the gate,
/// or if no side can be compared.
std::optional<BoxScore> scoreBox(const BoxMeasurement& z, const ProjectedBox& predicted,
                                 const Eigen::Matrix4d& covariance,
                                 const std::array<bool, 4>& hidden,
                                 const BoxParameters& parameters);

/// Returns the sides that can be compared: measured, not hidden, and exact in the projection.
std::array<bool, 4> comparableSides(const BoxMeasurement& z, const ProjectedBox& predicted,
                                    const std::array<bool, 4>& hidden);

}  // namespace perdure::semantic_filter
